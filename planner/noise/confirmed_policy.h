#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/noise/noisy_belief_graph.h"
#include "feeler/planner/search/greedy_completion.h"

namespace feeler::planner {

/// A first policy of a noisy problem, as an incumbent of BoundedSearch: at each belief the move that the greedy policy
/// of the problem without noise makes for the likeliest hypotheses, so many that what is left out is less than a
/// declaration may leave out. Contacts are confirmed by it as long as that set holds hypotheses that deny them. It ends
/// where something may be declared, and where the beliefs that it has been worked out for end (which has its price).
class ConfirmedPolicy {
 public:
  using Stop = std::function<std::optional<SolverStatus>(std::int64_t)>;

  /// Everything must outlive the policy.
  ConfirmedPolicy(NoisyBeliefGraph& graph, const PlanningTables& tables);

  /// Works it out from the start belief, most probable beliefs first, until what is left adds little to its cost or
  /// `stop` says so. Values hold whenever it stops.
  void Run(const Stop& stop);

  bool Solved(std::uint32_t /*b*/) const { return true; }
  double Value(std::uint32_t b) const { return b < value_.size() && value_[b] >= 0.0 ? value_[b] : graph_.EndCost(b); }
  int Action(std::uint32_t /*b*/) const { return 0; }  ///< to be asked for by Move
  /// The move at any belief, worked out or not; cells = 0: ends.
  GuardedMove Choose(std::uint32_t b, const Stop& stop);
  /// cells = 0: ends.
  GuardedMove Move(std::uint32_t b) const { return b < move_.size() ? move_[b] : GuardedMove{Direction::kPlusX, 0}; }
  std::int64_t expansions() const { return static_cast<std::int64_t>(order_.size()); }
  std::size_t bytes() const;

 private:
  struct Step {
    std::uint32_t belief = 0;
    double cost = 0.0;
    std::size_t first = 0, count = 0;  ///< of branches_
  };
  void Settle(const Stop& stop);

  NoisyBeliefGraph& graph_;
  BeliefGraph sure_;
  std::unique_ptr<BeliefHeuristic> heuristic_;
  GreedyCompletion<BeliefGraph> greedy_;
  std::vector<double> value_;  ///< by belief; negative: not worked out
  std::vector<GuardedMove> move_;
  std::vector<Step> order_;
  std::vector<NoisyBeliefGraph::Successor> branches_;
};

}  // namespace feeler::planner
