#include "feeler/planner/pomdp/files/factored_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <unordered_map>
#include <unordered_set>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/files/table_builder.h"

namespace feeler::planner {
namespace {

/// Joint values of some variables, numbered as they are met.
class JointValues {
 public:
  JointValues(const std::vector<FactorVariable>& variables, std::vector<std::size_t> members)
      : variables_(variables), members_(std::move(members)) {}

  std::uint32_t Number(const Assignment& at) {
    std::uint64_t key = 0;
    for (const std::size_t v : members_) key = key * variables_[v].count() + at[v];
    const auto [found, added] = number_.try_emplace(key, static_cast<std::uint32_t>(keys_.size()));
    if (added) keys_.push_back(key);
    return found->second;
  }
  std::size_t size() const { return keys_.size(); }
  /// Writes the values into other variables (the same number of them).
  void Decode(std::size_t number, const std::vector<std::size_t>& into, Assignment& at) const {
    std::uint64_t key = keys_[number];
    for (std::size_t i = members_.size(); i-- > 0;) {
      const std::size_t count = variables_[members_[i]].count();
      at[into[i]] = static_cast<std::uint32_t>(key % count);
      key /= count;
    }
  }
  std::string Name(std::size_t number) const {
    Assignment at(variables_.size(), 0);
    Decode(number, members_, at);
    std::string name;
    for (const std::size_t v : members_) name += (name.empty() ? "" : ".") + variables_[v].values[at[v]];
    return name;
  }

 private:
  const std::vector<FactorVariable>& variables_;
  std::vector<std::size_t> members_;
  std::unordered_map<std::uint64_t, std::uint32_t> number_;
  std::vector<std::uint64_t> keys_;
};

/// Makes names different that came out the same ("a" and "b.c", "a.b" and "c").
void Distinguish(std::vector<std::string>& names) {
  std::unordered_set<std::string> taken(names.begin(), names.end());
  if (taken.size() == names.size()) return;
  std::unordered_set<std::string> met;
  for (std::string& name : names) {
    if (met.insert(name).second) continue;
    std::string other;
    for (int k = 2; other.empty() || !taken.insert(other).second; ++k) other = fmt::format("{}.{}", name, k);
    name = other;
    met.insert(name);
  }
}

double Product(const std::vector<FactorVariable>& variables, const std::vector<std::size_t>& members) {
  double product = 1.0;
  for (const std::size_t v : members) product *= static_cast<double>(variables[v].count());
  return product;
}

class Joiner {
 public:
  Joiner(const FactoredPomdp& factored, Pulse& pulse)
      : factored_(factored),
        pulse_(pulse),
        before_(Members([](const auto& s) { return s.before; })),
        after_(Members([](const auto& s) { return s.after; })),
        states_(factored.variables, after_),
        observations_(factored.variables, Observed()),
        at_(factored.variables.size(), 0) {
    for (const double joint : {Product(factored.variables, before_), Product(factored.variables, factored.actions)}) {
      if (joint > 1e18) RequireFits(factored.name, joint, 1.0, joint);
    }
    initial_ = Sorted(factored.initial);
    transitions_ = Sorted(factored.transitions);
    sensors_ = Sorted(factored.sensors);
    action_count_ = Product(factored.variables, factored.actions);
    RequireFits(factored.name, 1.0, action_count_, 0.0);
  }

  Pomdp Run() {
    Start();
    for (std::size_t s = 0; s < states_.size(); ++s) Expand(s);
    return Assemble();
  }

 private:
  template <class F>
  std::vector<std::size_t> Members(F f) const {
    std::vector<std::size_t> members;
    for (const FactoredPomdp::StateVariable& s : factored_.states) members.push_back(f(s));
    return members;
  }
  std::vector<std::size_t> Observed() const {
    std::vector<std::size_t> observed;
    for (const FactoredPomdp::StateVariable& s : factored_.states) {
      if (s.observed) observed.push_back(s.after);
    }
    observed.insert(observed.end(), factored_.observations.begin(), factored_.observations.end());
    return observed;
  }

  /// Tables so that parents which are targets of other tables come first.
  std::vector<const FactorTable*> Sorted(const std::vector<FactorTable>& tables) const {
    std::vector<const FactorTable*> sorted;
    while (sorted.size() < tables.size()) {
      const std::size_t before = sorted.size();
      for (const FactorTable& table : tables) {
        if (std::ranges::find(sorted, &table) != sorted.end()) continue;
        const bool ready = std::ranges::all_of(table.scope(), [&](std::size_t v) {
          return v == table.target() || std::ranges::none_of(tables, [&](const FactorTable& other) {
                   return other.target() == v && std::ranges::find(sorted, &other) == sorted.end();
                 });
        });
        if (ready) sorted.push_back(&table);
      }
      if (sorted.size() > before) continue;
      throw InputError(fmt::format("{}:{}", factored_.name, tables.front().line()),
                       "variables are parents of each other in a circle", "break it");
    }
    return sorted;
  }

  /// Calls f(probability) for each joint value of the targets of `tables`, with the assignment in at_.
  void ForEach(const std::vector<const FactorTable*>& tables, std::size_t from, double probability,
               const std::function<void(double)>& f) {
    constexpr std::size_t kTableWork = 200;
    pulse_(kTableWork);
    if (from == tables.size()) return f(probability);
    const FactorTable& table = *tables[from];
    std::vector<SparseEntry> distribution;
    table.Distribution(at_, distribution);
    double sum = 0.0;
    for (const SparseEntry& entry : distribution) sum += entry.value;
    if (!(std::abs(sum - 1.0) <= kSumTolerance)) {
      throw InputError(fmt::format("{}:{}", factored_.name, table.LineOf(at_)),
                       fmt::format("the probabilities of {} given {} sum to {:.6g}, not 1",
                                   factored_.variables[table.target()].name, table.Describe(at_), sum),
                       "mend the table");
    }
    for (const SparseEntry& entry : distribution) {
      at_[table.target()] = entry.index;
      ForEach(tables, from + 1, probability * entry.value / sum, f);
    }
  }

  /// A lower bound of the joint values of the targets that any values of the parents leave possible.
  double LeastOutcomes(const std::vector<const FactorTable*>& tables) {
    constexpr double kMostParents = 4096.0;
    double product = 1.0;
    std::vector<SparseEntry> distribution;
    for (const FactorTable* table : tables) {
      std::vector<std::size_t> parents = table->scope();
      std::erase(parents, table->target());
      const double assignments = Product(factored_.variables, parents);
      if (assignments > kMostParents) continue;
      std::size_t least = factored_.variables[table->target()].count();
      for (std::size_t number = 0; number < static_cast<std::size_t>(assignments); ++number) {
        std::size_t rest = number;
        for (const std::size_t v : parents) {
          at_[v] = static_cast<std::uint32_t>(rest % factored_.variables[v].count());
          rest /= factored_.variables[v].count();
        }
        table->Distribution(at_, distribution);
        least = std::min(least, distribution.size());
      }
      product *= static_cast<double>(std::max<std::size_t>(1, least));
    }
    return product;
  }

  void Start() {
    // What has too many outcomes whatever the parents are is refused before it is written out.
    const double states = LeastOutcomes(initial_);
    const double entries = states * action_count_ * (LeastOutcomes(transitions_) + LeastOutcomes(sensors_));
    RequireFits(factored_.name, states, action_count_, entries);
    ForEach(initial_, 0, 1.0, [&](double p) {
      for (std::size_t i = 0; i < before_.size(); ++i) at_[after_[i]] = at_[before_[i]];
      start_.push_back({states_.Number(at_), p});
      RequireSpace(0.0);
    });
  }

  void SetAction(std::size_t number) {
    for (std::size_t i = factored_.actions.size(); i-- > 0;) {
      const std::size_t count = factored_.variables[factored_.actions[i]].count();
      at_[factored_.actions[i]] = static_cast<std::uint32_t>(number % count);
      number /= count;
    }
  }

  /// What is joined so far, and `more` probabilities, must fit.
  void RequireSpace(double more) const {
    RequireFits(factored_.name, static_cast<double>(states_.size()), action_count_,
                static_cast<double>(entries_) + more);
  }

  bool NeedsSensors(const FactorTable& reward) const {
    return std::ranges::any_of(reward.scope(), [&](std::size_t v) {
      return std::ranges::find(factored_.observations, v) != factored_.observations.end();
    });
  }

  void Expand(std::size_t s) {
    for (std::size_t a = 0; a < static_cast<std::size_t>(action_count_); ++a) {
      SetAction(a);
      states_.Decode(s, before_, at_);
      std::vector<SparseEntry> row;
      double reward = 0.0;
      ForEach(transitions_, 0, 1.0, [&](double p) {
        row.push_back({states_.Number(at_), p});
        RequireSpace(static_cast<double>(row.size()));
        for (const FactorTable& table : factored_.rewards) {
          if (!NeedsSensors(table)) {
            reward += p * table.Value(at_);
            continue;
          }
          ForEach(sensors_, 0, 1.0, [&](double q) { reward += p * q * table.Value(at_); });
        }
      });
      std::ranges::sort(row, {}, &SparseEntry::index);
      entries_ += row.size();
      rows_.push_back(std::move(row));
      rewards_.push_back(reward);
    }
  }

  Pomdp Assemble() {
    Pomdp pomdp;
    pomdp.name = factored_.name;
    pomdp.discount = factored_.discount;
    pomdp.start = start_;
    std::ranges::sort(pomdp.start, {}, &SparseEntry::index);
    const auto actions = static_cast<std::size_t>(action_count_);
    for (std::size_t s = 0; s < states_.size(); ++s) pomdp.states.push_back(states_.Name(s));
    for (std::size_t a = 0; a < actions; ++a) {
      SetAction(a);
      std::string name;
      for (const std::size_t v : factored_.actions) {
        name += (name.empty() ? "" : ".") + factored_.variables[v].values[at_[v]];
      }
      pomdp.actions.push_back(name);
      std::vector<SparseEntry> row;
      for (std::size_t s = 0; s < states_.size(); ++s) {
        pomdp.transitions.Append(rows_[s * actions + a]);
        pomdp.reward.push_back(rewards_[s * actions + a]);
        states_.Decode(s, after_, at_);
        row.clear();
        ForEach(sensors_, 0, 1.0, [&](double p) {
          row.push_back({observations_.Number(at_), p});
          RequireSpace(static_cast<double>(row.size() + observations_.size()));
        });
        entries_ += row.size();
        std::ranges::sort(row, {}, &SparseEntry::index);
        pomdp.observation_rows.Append(row);
      }
    }
    for (std::size_t o = 0; o < observations_.size(); ++o) pomdp.observations.push_back(observations_.Name(o));
    for (std::vector<std::string>* names : {&pomdp.states, &pomdp.actions, &pomdp.observations}) Distinguish(*names);
    return pomdp;
  }

  const FactoredPomdp& factored_;
  Pulse& pulse_;
  std::vector<std::size_t> before_, after_;
  JointValues states_, observations_;
  Assignment at_;
  std::vector<const FactorTable*> initial_, transitions_, sensors_;
  double action_count_ = 1.0;
  std::vector<SparseEntry> start_;
  std::vector<std::vector<SparseEntry>> rows_;  ///< s |A| + a
  std::vector<double> rewards_;
  std::size_t entries_ = 0;
};

}  // namespace

Pomdp Join(const FactoredPomdp& factored, Pulse& pulse) { return Joiner(factored, pulse).Run(); }

}  // namespace feeler::planner
