#include "feeler/planner/pomdp/search/pomdp_belief_graph.h"

#include <algorithm>
#include <cmath>

namespace feeler::planner {

PomdpBeliefGraph::PomdpBeliefGraph(const Pomdp& pomdp, const StateBounds& bounds, int levels)
    : pomdp_(pomdp), bounds_(bounds), levels_(levels), absorbing_(AbsorbingStates(pomdp)) {
  if (pomdp.discount < 1.0) {
    constant_ = *std::ranges::max_element(pomdp.reward);
    to_goal_ = constant_ / (1.0 - pomdp.discount);
  }
  Intern(pomdp.start);
}

bool PomdpBeliefGraph::IsGoal(std::span<const SparseEntry> belief) const {
  return std::ranges::all_of(belief, [&](const SparseEntry& s) { return absorbing_[s.index] != 0; });
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
  const auto [begin, end] = index_.equal_range(HashOf(belief));
  for (auto it = begin; it != end; ++it) {
    if (Same(beliefs_[it->second].states, belief)) return it->second;
  }
  return kNone;
}

std::uint32_t PomdpBeliefGraph::Intern(std::vector<SparseEntry> belief) {
  const std::uint32_t known = Find(belief);
  if (known != kNone) return known;
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

void PomdpBeliefGraph::Expand(std::uint32_t b) {
  const std::vector<SparseEntry> belief = beliefs_[b].states;  // Intern may move the beliefs
  const auto first_action = static_cast<std::uint32_t>(actions_.size());
  BeliefUpdate update(pomdp_);
  for (std::uint32_t a = 0; a < pomdp_.action_count(); ++a) {
    Action action{CostOf(belief, a), a, static_cast<std::uint32_t>(successors_.size()), 0};
    bool moves = false;
    update(belief, a, [&](std::uint32_t o, double probability, const std::vector<SparseEntry>& next) {
      const double share = probability * pomdp_.discount;
      if (IsGoal(next)) {
        action.cost += share * to_goal_;
        moves = true;
        return;
      }
      const std::uint32_t successor = Intern(next);
      moves = moves || successor != b;
      successors_.push_back({successor, o, share});
      ++action.count;
    });
    // Without discount an action that changes nothing leads nowhere: no policy needs it.
    if (!moves && pomdp_.discount == 1.0) {
      successors_.resize(action.first);
      continue;
    }
    actions_.push_back(action);
    bytes_ += sizeof(Action) + action.count * sizeof(Successor);
  }
  beliefs_[b].first_action = first_action;
  beliefs_[b].action_count = static_cast<std::uint32_t>(actions_.size()) - first_action;
}

}  // namespace feeler::planner
