#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include "planner/belief/belief_graph.h"
#include "planner/solver/greedy_completion.h"
#include "planner/solver/policy.h"

namespace feeler::planner {

/// A policy that was made for another contact map, carried over to a belief graph as an incumbent: its moves are made
/// where its outcomes are met, and what it does not foresee (an outcome without a branch, or a leaf that is no goal) is
/// completed greedily. Works for any policy; it is a good one where the maps nearly agree.
///
/// The value of a belief is the least cost of the ways in which the policy comes by it, and of the greedy completion
/// where that knows it. It is at least the cost of the recorded action plus the values of its outcomes, so following
/// recorded actions costs at most the value, and never cycles. Same interface as GreedyCompletion.
class CarriedPolicy {
 public:
  /// The policy's root is the graph's start.
  CarriedPolicy(BeliefGraph& graph, const Policy& policy, GreedyCompletion<BeliefGraph>& completion);

  bool Solved(BeliefId b) const { return Known(b) || completion_.Solved(b); }
  double Value(BeliefId b) const {
    return std::min(Known(b) ? nodes_[b].value : kInfinity, completion_.Solved(b) ? completion_.Value(b) : kInfinity);
  }
  int Action(BeliefId b) const {
    const bool own = Known(b) && (!completion_.Solved(b) || nodes_[b].value < completion_.Value(b));
    return own ? nodes_[b].action : completion_.Action(b);
  }
  std::int64_t expansions() const { return expansions_ + completion_.expansions(); }
  std::int64_t trials() const { return 0; }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  struct State {
    double value = kInfinity;
    std::int32_t action = -1;
  };
  bool Known(BeliefId b) const { return b < nodes_.size() && nodes_[b].action >= 0; }
  /// Cost to go, times the weight, of following the policy from one of its nodes.
  double Follow(BeliefId b, std::uint32_t node);
  double Complete(BeliefId b);

  BeliefGraph& graph_;
  const Policy& policy_;
  GreedyCompletion<BeliefGraph>& completion_;
  std::vector<State> nodes_;
  std::unordered_map<std::uint64_t, double> followed_;  ///< by belief and policy node
  std::int64_t expansions_ = 0;
};

}  // namespace feeler::planner
