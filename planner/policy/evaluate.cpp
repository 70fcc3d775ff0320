#include "feeler/planner/policy/evaluate.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "feeler/planner/policy/policy_replay.h"

namespace feeler::planner {

PolicyEvaluation Evaluate(const Problem& problem, const PolicyGraph& policy) {
  PolicyEvaluation evaluation;
  const PolicyReplay replay = Replay(problem, policy);
  evaluation.fault = replay.fault;
  if (!replay.fault.empty()) {
    evaluation.expected_cost = std::numeric_limits<double>::infinity();
    evaluation.worst_cost = evaluation.expected_cost;
    return evaluation;
  }
  const std::vector<ExpandedNode>& nodes = replay.tree.nodes;
  evaluation.expected_cost = replay.tree.expected_cost;
  evaluation.cost.resize(problem.hypotheses.size());
  std::vector<double> cost_so_far(nodes.size(), 0.0);
  for (std::size_t i = 0; i < nodes.size(); ++i) {  // parents come before children
    const ExpandedNode& node = nodes[i];
    for (const ExpandedBranch& branch : node.outcomes) {
      const auto next = static_cast<std::size_t>(branch.next);
      const double probability = nodes[next].probability;
      cost_so_far[next] = cost_so_far[i] + problem.cost.Of(branch.outcome, node.move.direction);
      evaluation.expected_moves += probability;
      evaluation.expected_contacts += branch.outcome.contact ? probability : 0.0;
      evaluation.expected_cells += probability * branch.outcome.cells;
    }
    if (!node.is_leaf()) continue;
    for (const int h : node.hypotheses) evaluation.cost[static_cast<std::size_t>(h)] = cost_so_far[i];
    evaluation.worst_cost = std::max(evaluation.worst_cost, cost_so_far[i]);
  }
  return evaluation;
}

}  // namespace feeler::planner
