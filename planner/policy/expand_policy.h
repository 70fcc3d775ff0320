#pragma once

#include <vector>

#include "feeler/planner/belief/problem.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::planner {

/// A policy in the coordinates of its problem, as a tree: what the policy file lists.
struct ExpandedBranch {
  Outcome outcome;
  int next = 0;
  double probability = 0.0;  ///< given the node
};
struct ExpandedNode {
  GuardedMove move;  ///< unused at a leaf
  std::vector<ExpandedBranch> outcomes;
  std::vector<int> hypotheses;  ///< indices of the hypotheses left, in problem order (filled at every node)
  Cell robot = Cell::Zero();    ///< robot cell on arrival
  double probability = 1.0;     ///< of reaching the node
  double expected_cost = 0.0;   ///< to go
  bool is_leaf() const { return outcomes.empty(); }
};
struct ExpandedPolicy {
  std::vector<ExpandedNode> nodes;  ///< node 0 is the root; parents before children
  double expected_cost = 0.0;
  double lower_bound = 0.0;
};

/// Expands the canonical graph from the root, with absolute robot cells and hypothesis indices. Throws NegativeResult
/// if the policy is not valid for the problem (see `Evaluate`).
ExpandedPolicy ExpandPolicy(const Problem& problem, const PolicyGraph& policy);

}  // namespace feeler::planner
