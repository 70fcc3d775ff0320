#include "feeler/planner/pomdp/model/observable_classes.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {
namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};
constexpr std::size_t kOutcomeWork = 8;  ///< see Pulse

class UnionFind {
 public:
  explicit UnionFind(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t Find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// True if they were apart.
  bool Join(std::uint32_t i, std::uint32_t j) {
    i = Find(i);
    j = Find(j);
    if (i == j) return false;
    parent_[std::max(i, j)] = std::min(i, j);
    return true;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Calls f(s', o, probability) for what action a can make of state s.
template <class F>
void ForEachOutcome(const Pomdp& pomdp, std::size_t a, std::uint32_t s, F f) {
  for (const SparseEntry& next : pomdp.transitions.Row(pomdp.At(a, s))) {
    for (const SparseEntry& o : pomdp.observation_rows.Row(pomdp.At(a, next.index)))
      f(next.index, o.index, next.value * o.value);
  }
}

/// Joins what the states of one group can become by the same action and observation. True if anything changed.
bool JoinSuccessors(const Pomdp& pomdp, const std::vector<std::uint32_t>& group, UnionFind& sets,
                    std::vector<std::uint8_t>& reached, std::vector<std::uint32_t>& first, Pulse& pulse) {
  bool changed = false;
  std::vector<std::uint32_t> seen;
  for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
    for (const std::uint32_t s : group) {
      ForEachOutcome(pomdp, a, s, [&](std::uint32_t next, std::uint32_t o, double) {
        pulse(kOutcomeWork);
        if (reached[next] == 0) reached[next] = 1, changed = true;
        if (first[o] == kNone) {
          first[o] = next;
          seen.push_back(o);
        } else if (sets.Join(first[o], next)) {
          changed = true;
        }
      });
    }
    for (const std::uint32_t o : seen) first[o] = kNone;
    seen.clear();
  }
  return changed;
}

std::vector<ClassOutcome> Outcomes(const Pomdp& pomdp, std::size_t a, const std::vector<std::uint32_t>& states,
                                   const std::vector<std::uint32_t>& class_of,
                                   const std::vector<std::uint32_t>& position, Pulse& pulse) {
  std::vector<ClassOutcome> outcomes;
  std::unordered_map<std::uint32_t, std::size_t> of;
  for (std::uint32_t from = 0; from < states.size(); ++from) {
    ForEachOutcome(pomdp, a, states[from], [&](std::uint32_t next, std::uint32_t o, double p) {
      pulse(kOutcomeWork);
      const auto [found, added] = of.try_emplace(o, outcomes.size());
      if (added) outcomes.push_back({o, class_of[next], {}});
      outcomes[found->second].steps.push_back({from, position[next], p});
    });
  }
  std::ranges::sort(outcomes, {}, &ClassOutcome::observation);
  return outcomes;
}

/// Joins until nothing changes.
void JoinAll(const Pomdp& pomdp, const std::vector<std::uint32_t>& root, UnionFind& sets,
             std::vector<std::vector<std::uint32_t>>& groups, Pulse& pulse) {
  std::vector<std::uint8_t> reached(pomdp.state_count(), 0);
  std::vector<std::uint32_t> first(pomdp.observation_count(), kNone);
  JoinSuccessors(pomdp, root, sets, reached, first, pulse);
  for (bool changed = true; changed;) {
    changed = false;
    for (auto& group : groups) group.clear();
    for (std::uint32_t s = 0; s < reached.size(); ++s) {
      if (reached[s] != 0) groups[sets.Find(s)].push_back(s);
    }
    pulse(kOutcomeWork * reached.size());
    for (const auto& group : groups) {
      if (!group.empty() && JoinSuccessors(pomdp, group, sets, reached, first, pulse)) changed = true;
    }
  }
}

ObservableClasses Find(const Pomdp& pomdp, Pulse& pulse) {
  const std::size_t count = pomdp.state_count();
  UnionFind sets(count);
  std::vector<std::uint32_t> root;
  for (const SparseEntry& s : pomdp.start) root.push_back(s.index);
  std::vector<std::vector<std::uint32_t>> groups(count);
  JoinAll(pomdp, root, sets, groups, pulse);

  ObservableClasses found;
  std::vector<std::uint32_t> class_of(count, kNone);
  std::vector<std::uint32_t> position(count, 0);
  for (auto& group : groups) {
    if (group.empty()) continue;
    for (std::uint32_t i = 0; i < group.size(); ++i) {
      class_of[group[i]] = static_cast<std::uint32_t>(found.classes.size());
      position[group[i]] = i;
    }
    found.classes.push_back({std::move(group), {}});
  }
  // The initial belief may spread over classes, or over states that are never met again: then it has one of its own.
  found.start_class = class_of[root[0]];
  for (const std::uint32_t s : root) {
    if (class_of[s] != found.start_class || class_of[s] == kNone)
      found.start_class = static_cast<std::uint32_t>(found.classes.size());
  }
  const bool own = found.start_class == found.classes.size() || found.start_class == kNone;
  if (own) {
    found.start_class = static_cast<std::uint32_t>(found.classes.size());
    found.classes.push_back({root, {}});
  }
  for (std::uint32_t i = 0; i < root.size(); ++i) {
    found.start.push_back({own ? i : position[root[i]], pomdp.start[i].value});
  }
  for (ObservableClasses::Class& c : found.classes) {
    for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
      c.outcomes.push_back(Outcomes(pomdp, a, c.states, class_of, position, pulse));
    }
  }
  return found;
}

}  // namespace

double OutcomeBytes(const Pomdp& pomdp) {
  double steps = 0.0;
  for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
    for (std::size_t s = 0; s < pomdp.state_count(); ++s) {
      for (const SparseEntry& next : pomdp.transitions.Row(pomdp.At(a, s))) {
        steps += static_cast<double>(pomdp.observation_rows.Row(pomdp.At(a, next.index)).size());
      }
    }
  }
  return steps * sizeof(ClassOutcome::Step);
}

std::optional<ObservableClasses> FindObservableClasses(const Pomdp& pomdp, const std::function<bool()>& stop) {
  Pulse pulse(stop);
  try {
    return Find(pomdp, pulse);
  } catch (const Interrupted&) {
    return std::nullopt;
  }
}

}  // namespace feeler::planner
