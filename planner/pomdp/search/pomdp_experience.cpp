#include "feeler/planner/pomdp/search/pomdp_experience.h"

#include <algorithm>
#include <cmath>

namespace feeler::planner {

PomdpExperience::PomdpExperience(PomdpBeliefGraph& graph, const PomdpController& policy, double epsilon,
                                 std::size_t limit, const std::function<bool()>& stop)
    : graph_(graph), epsilon_(epsilon) {
  RollOut(policy, limit);
  Sweep(Pulse(stop));
}

void PomdpExperience::RollOut(const PomdpController& policy, std::size_t limit) {
  std::unordered_map<std::uint64_t, std::uint32_t> number;
  const auto of = [&](std::uint32_t belief, std::uint32_t node) {
    const auto [found, added] =
        number.try_emplace(std::uint64_t{belief} << 32 | node, static_cast<std::uint32_t>(entries_.size()));
    if (added) entries_.push_back({belief, node, 0.0, {}, false, epsilon_ * graph_.Heuristic(belief)});
    return found->second;
  };
  of(graph_.Start(), policy.root);
  for (std::size_t i = 0; i < entries_.size() && i < limit; ++i) {
    const std::uint32_t node = entries_[i].node;
    const std::uint32_t b = entries_[i].belief;
    const auto actions = graph_.Actions(b);
    const auto action = std::ranges::find(actions, policy.nodes[node].action, &PomdpBeliefGraph::Action::action);
    if (action == actions.end()) continue;
    const PomdpBeliefGraph::Action chosen = *action;
    std::vector<std::pair<std::uint32_t, double>> branches;
    for (std::uint32_t k = 0; k < chosen.count; ++k) {
      const PomdpBeliefGraph::Successor next = graph_.Successors(chosen)[k];
      branches.emplace_back(of(next.belief, policy.Next(node, next.observation)), next.share);
    }
    entries_[i].cost = chosen.cost;
    entries_[i].branches = std::move(branches);
    entries_[i].followed = true;
  }
}

/// Equation 6: the least of jumping to the goal, and of following the experience; jumps between beliefs of B^E are left
/// to operator().
void PomdpExperience::Sweep(Pulse pulse) {
  for (int sweep = 0; sweep < 1000; ++sweep) {
    double change = 0.0;
    for (std::size_t i = entries_.size(); i-- > 0;) {
      Entry& entry = entries_[i];
      if (!entry.followed) continue;
      pulse(5 * entry.branches.size() + 10);
      double value = entry.cost;
      for (const auto& [next, share] : entry.branches) value += share * entries_[next].value;
      value = std::min(value, epsilon_ * graph_.Heuristic(entry.belief));
      change = std::max(change, std::abs(value - entry.value) / std::max(1.0, value));
      entry.value = value;
    }
    if (change <= 1e-9) break;
  }
  for (const Entry& entry : entries_) {
    const auto [found, added] = value_of_.try_emplace(entry.belief, entry.value);
    if (!added) found->second = std::min(found->second, entry.value);
  }
  for (const auto& [belief, value] : value_of_) {
    const double heuristic = graph_.Heuristic(belief);
    if (value < epsilon_ * heuristic) targets_[StatesOf(belief)].push_back({heuristic, value});
  }
  for (auto& [states, targets] : targets_) std::ranges::sort(targets, {}, &Target::value);
}

std::uint64_t PomdpExperience::StatesOf(std::uint32_t b) const {
  std::uint64_t hash = 0x9E3779B97F4A7C15;
  for (const SparseEntry& s : graph_.Belief(b)) {
    hash = (hash ^ s.index) * 0xFF51AFD7ED558CCD;
    hash ^= hash >> 31;
  }
  return hash;
}

double PomdpExperience::operator()(std::uint32_t b) const {
  const double heuristic = graph_.Heuristic(b);
  double best = epsilon_ * heuristic;
  if (const auto found = value_of_.find(b); found != value_of_.end()) best = std::min(best, found->second);
  const auto targets = targets_.find(StatesOf(b));
  if (targets == targets_.end()) return best;
  for (const Target& target : targets->second) {
    if (target.value >= best) break;
    best = std::min(best, epsilon_ * std::max(0.0, heuristic - target.heuristic) + target.value);
  }
  return best;
}

}  // namespace feeler::planner
