#include "feeler/planner/pomdp/search/pomdp_belief_graph.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace feeler::planner {

PomdpBeliefGraph::PomdpBeliefGraph(const Pomdp& pomdp, const StateBounds& bounds, int levels)
    : pomdp_(pomdp), bounds_(bounds), levels_(levels), absorbing_(AbsorbingStates(pomdp)) {
  if (pomdp.discount < 1.0) {
    constant_ = *std::ranges::max_element(pomdp.reward);
    to_goal_ = constant_ / (1.0 - pomdp.discount);
  }
  if (pomdp.discount == 1.0 && levels == 0) FindTwins();
  std::vector<SparseEntry> start = pomdp.start;
  if (!Trivial()) start_share_ = DropGoals(start);
  Intern(std::move(start));
}

void PomdpBeliefGraph::FindTwins() {
  const auto same = [&](std::uint32_t s, std::uint32_t t) {
    for (std::size_t a = 0; a < pomdp_.action_count(); ++a) {
      if (pomdp_.reward[pomdp_.At(a, s)] != pomdp_.reward[pomdp_.At(a, t)]) return false;
      const auto equal = [](const SparseEntry& x, const SparseEntry& y) {
        return x.index == y.index && x.value == y.value;
      };
      if (!std::ranges::equal(pomdp_.transitions.Row(pomdp_.At(a, s)), pomdp_.transitions.Row(pomdp_.At(a, t)), equal))
        return false;
    }
    return true;
  };
  std::unordered_multimap<std::uint64_t, std::uint32_t> first;
  for (std::uint32_t s = 0; s < pomdp_.state_count(); ++s) {
    std::uint64_t hash = 0x9E3779B97F4A7C15;
    for (std::size_t a = 0; a < pomdp_.action_count(); ++a) {
      for (const SparseEntry& e : pomdp_.transitions.Row(pomdp_.At(a, s))) {
        hash = (hash ^ e.index ^ std::bit_cast<std::uint64_t>(e.value)) * 0xFF51AFD7ED558CCD;
        hash ^= hash >> 31;
      }
      hash ^= std::bit_cast<std::uint64_t>(pomdp_.reward[pomdp_.At(a, s)] + 0.0);
    }
    std::uint32_t twin = s;
    const auto [begin, end] = first.equal_range(hash);
    for (auto it = begin; it != end && twin == s; ++it) {
      if (same(it->second, s)) twin = it->second;
    }
    if (twin == s) first.emplace(hash, s);
    twin_.push_back(twin);
  }
}

std::vector<SparseEntry> PomdpBeliefGraph::Merged(std::span<const SparseEntry> belief) const {
  std::vector<SparseEntry> merged(belief.begin(), belief.end());
  if (twin_.empty()) return merged;
  for (SparseEntry& s : merged) s.index = twin_[s.index];
  std::ranges::sort(merged, {}, &SparseEntry::index);
  std::size_t count = 0;
  for (const SparseEntry& s : merged) {
    if (count > 0 && merged[count - 1].index == s.index) {
      merged[count - 1].value += s.value;
    } else {
      merged[count++] = s;
    }
  }
  merged.resize(count);
  return merged;
}

bool PomdpBeliefGraph::IsGoal(std::span<const SparseEntry> belief) const {
  return std::ranges::all_of(belief, [&](const SparseEntry& s) { return absorbing_[s.index] != 0; });
}

double PomdpBeliefGraph::DropGoals(std::vector<SparseEntry>& belief) const {
  if (pomdp_.discount < 1.0) return 1.0;
  if (std::erase_if(belief, [&](const SparseEntry& s) { return absorbing_[s.index] != 0; }) == 0) return 1.0;
  double left = 0.0;
  for (const SparseEntry& s : belief) left += s.value;
  for (SparseEntry& s : belief) s.value /= left;
  return left;
}

bool PomdpBeliefGraph::Unchanged(std::span<const SparseEntry> before, std::span<const SparseEntry> after) {
  constexpr double kRounding = 1e-9;
  return std::ranges::equal(before, after, [](const SparseEntry& x, const SparseEntry& y) {
    return x.index == y.index && std::abs(x.value - y.value) <= kRounding * x.value;
  });
}

std::int64_t PomdpBeliefGraph::Level(double probability) const {
  constexpr double kRounding = 1e12;
  if (levels_ == 0) return std::llround(probability * kRounding);
  return static_cast<std::int64_t>(std::ceil(probability * levels_ - 1e-9));
}

std::uint64_t PomdpBeliefGraph::HashOf(std::span<const SparseEntry> belief) const {
  std::uint64_t hash = 0x9E3779B97F4A7C15;
  for (const SparseEntry& s : belief) {
    hash = (hash ^ (std::uint64_t{s.index} << 44 ^ static_cast<std::uint64_t>(Level(s.value)))) * 0xFF51AFD7ED558CCD;
    hash ^= hash >> 31;
  }
  return hash;
}

bool PomdpBeliefGraph::Same(std::span<const SparseEntry> a, std::span<const SparseEntry> b) const {
  return std::ranges::equal(a, b, [&](const SparseEntry& x, const SparseEntry& y) {
    return x.index == y.index && Level(x.value) == Level(y.value);
  });
}

std::uint32_t PomdpBeliefGraph::Find(std::span<const SparseEntry> belief) const {
  return twin_.empty() ? FindMerged(belief) : FindMerged(Merged(belief));
}

std::uint32_t PomdpBeliefGraph::FindMerged(std::span<const SparseEntry> belief) const {
  const auto [begin, end] = index_.equal_range(HashOf(belief));
  for (auto it = begin; it != end; ++it) {
    if (Same(beliefs_[it->second].states, belief)) return it->second;
  }
  return kNone;
}

std::uint32_t PomdpBeliefGraph::Intern(std::vector<SparseEntry> belief) {
  if (!twin_.empty()) belief = Merged(belief);
  const std::uint32_t known = FindMerged(belief);
  if (known != kNone) return known;
  pulse_(belief.size() * pomdp_.action_count());
  const auto number = static_cast<std::uint32_t>(beliefs_.size());
  index_.emplace(HashOf(belief), number);
  bytes_ += sizeof(Node) + 64 + belief.size() * sizeof(SparseEntry);
  const double heuristic = std::max(0.0, HeuristicOf(belief));
  beliefs_.push_back({std::move(belief), heuristic, kUnexpanded, 0});
  return number;
}

double PomdpBeliefGraph::CostOf(std::span<const SparseEntry> belief, std::size_t action) const {
  double cost = 0.0;
  for (const SparseEntry& s : belief) cost += s.value * (constant_ - pomdp_.reward[pomdp_.At(action, s.index)]);
  return cost;
}

void PomdpBeliefGraph::RepeatUntilChanged(std::uint32_t b, double to_goal, Action& action) {
  double leaves = to_goal;  // summed up itself: 1 - what stays would be rounding where that is almost 1
  double stays = 0.0;
  for (std::size_t i = action.first; i < successors_.size(); ++i) {
    (successors_[i].belief == b ? stays : leaves) += successors_[i].share;
  }
  if (stays == 0.0 || leaves == 0.0) return;
  const auto first = successors_.begin() + static_cast<std::ptrdiff_t>(action.first);
  successors_.erase(std::remove_if(first, successors_.end(), [&](const Successor& s) { return s.belief == b; }),
                    successors_.end());
  action.count = static_cast<std::uint32_t>(successors_.size()) - action.first;
  action.cost /= leaves;
  for (std::size_t i = action.first; i < successors_.size(); ++i) successors_[i].share /= leaves;
}

std::uint32_t PomdpBeliefGraph::Restart() {
  for (Node& node : beliefs_) node.first_action = kUnexpanded;
  std::vector<SparseEntry> start = pomdp_.start;
  DropGoals(start);
  SetEntered(Start(), std::move(start));
  return Start();
}

std::uint32_t PomdpBeliefGraph::Enter(const Action& action, std::uint32_t k) {
  const Successor chosen = Successors(action)[k];
  std::vector<SparseEntry> open;
  BeliefUpdate update(pomdp_, &pulse_);
  update(entered_, action.action, [&](std::uint32_t o, double, const std::vector<SparseEntry>& next) {
    if (o == chosen.observation) open = next;
  });
  DropGoals(open);
  SetEntered(chosen.belief, std::move(open));
  return chosen.belief;
}

void PomdpBeliefGraph::SetEntered(std::uint32_t number, std::vector<SparseEntry> belief) {
  beliefs_[entered_number_].first_action = kUnexpanded;
  actions_.clear();
  successors_.clear();
  entered_ = std::move(belief);
  entered_number_ = number;
}

void PomdpBeliefGraph::Expand(std::uint32_t b) {
  const std::vector<SparseEntry> belief = entered_.empty() ? beliefs_[b].states : entered_;  // Intern moves beliefs
  const bool exact = levels_ == 0 || !entered_.empty();
  const auto first_action = static_cast<std::uint32_t>(actions_.size());
  BeliefUpdate update(pomdp_, &pulse_);
  for (std::uint32_t a = 0; a < pomdp_.action_count(); ++a) {
    Action action{CostOf(belief, a), a, static_cast<std::uint32_t>(successors_.size()), 0};
    bool changes = false;
    double to_goal = 0.0;
    update(belief, a, [&](std::uint32_t o, double probability, const std::vector<SparseEntry>& next) {
      const double share = probability * pomdp_.discount;
      if (IsGoal(next)) {
        action.cost += share * to_goal_;
        to_goal += share;
        return;
      }
      std::vector<SparseEntry> open = next;
      const double left = DropGoals(open);
      for (const SparseEntry& s : left < 1.0 ? std::span(next) : std::span<const SparseEntry>()) {
        if (absorbing_[s.index] != 0) to_goal += share * s.value;
      }
      const std::uint32_t successor = Intern(open);
      changes = changes || successor != b || (exact && action.cost > 0.0 && !Unchanged(belief, Merged(open)));
      successors_.push_back({successor, o, share * left});
      ++action.count;
    });
    // Without discount an action that changes nothing leads nowhere: no policy needs it.
    if (!changes && to_goal == 0.0 && pomdp_.discount == 1.0) {
      successors_.resize(action.first);
      continue;
    }
    if (!twin_.empty()) RepeatUntilChanged(b, to_goal, action);
    actions_.push_back(action);
    if (entered_.empty()) bytes_ += sizeof(Action) + action.count * sizeof(Successor);
  }
  beliefs_[b].first_action = first_action;
  beliefs_[b].action_count = static_cast<std::uint32_t>(actions_.size()) - first_action;
}

}  // namespace feeler::planner
