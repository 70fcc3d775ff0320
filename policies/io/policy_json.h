#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "feeler/planner/belief/problem.h"
#include "feeler/planner/policy/expand_policy.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::policies {

/// One node of a policy file: a guarded move with its outcomes, or a leaf with the hypotheses left.
struct PolicyFileNode {
  struct Branch {
    Outcome outcome;
    int next = 0;
  };
  GuardedMove move;  ///< unused at a leaf
  std::vector<Branch> outcomes;
  std::vector<int> hypotheses;  ///< indices, at a leaf
  bool is_leaf() const { return outcomes.empty(); }
};

/// A policy file (docs/file-formats.md): a policy in the coordinates of its problem.
struct PolicyFile {
  std::string task;  ///< task or problem name
  Cell start = Cell::Zero();
  double expected_cost = 0.0;
  double lower_bound = 0.0;
  std::vector<Cell> hypotheses;   ///< the start belief, in problem order
  std::vector<int> orientations;  ///< of the hypotheses; empty if all are 0
  int root = 0;
  std::vector<PolicyFileNode> nodes;
};

/// The file of a policy: canonical coordinates expanded, every move a listed one, leaves with the indices of the
/// problem's hypotheses. Throws NegativeResult if the policy is not valid for the problem.
PolicyFile ToPolicyFile(const planner::Problem& problem, const planner::PolicyGraph& policy, const std::string& task);

/// The policy of a file, every shift zero, with probabilities and costs to go from the problem's weights and costs.
/// Throws InputError if the file is not about this problem (start, hypotheses). Whether the moves do what the file says
/// is planner::Evaluate's to check.
planner::PolicyGraph ToPolicy(const PolicyFile& file, const planner::Problem& problem, const std::string& where);

/// Law: ParsePolicyFile(FormatPolicyFile(f)) = f, doubles bit for bit.
std::string FormatPolicyFile(const PolicyFile& file);

/// Throws InputError naming file and field: unknown or missing keys, indices out of range, a cycle, contact flags that
/// contradict distances, an outcome twice, hypotheses that do not each end in exactly one leaf on exactly one path.
PolicyFile ParsePolicyFile(std::string_view text, const std::string& where);
PolicyFile ReadPolicyFile(const std::string& path);

}  // namespace feeler::policies
