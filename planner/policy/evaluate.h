#pragma once

#include <string>
#include <vector>

#include "feeler/planner/belief/problem.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::planner {

/// What a policy does, exactly, over every hypothesis of the start belief.
struct PolicyEvaluation {
  /// Empty if the policy is valid; else the first fault found, in words: a cycle, a move that is not applicable or of
  /// an unlisted length, an outcome without a branch, a branch that no hypothesis takes, a leaf that lists other
  /// hypotheses than reach it or is no goal.
  std::string fault;
  double expected_cost = 0.0;
  double worst_cost = 0.0;
  double expected_moves = 0.0;
  double expected_contacts = 0.0;
  double expected_cells = 0.0;  ///< distance travelled
  std::vector<double> cost;     ///< per hypothesis, in problem order
  bool valid() const { return fault.empty(); }
};

/// Replays the policy under every hypothesis against the contact map, independently of the solvers. Never throws for a
/// bad policy (node indices out of range included): the fault says what is wrong.
PolicyEvaluation Evaluate(const Problem& problem, const PolicyGraph& policy);

}  // namespace feeler::planner
