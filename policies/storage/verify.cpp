#include "feeler/policies/storage/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "feeler/planner/policy/evaluate.h"
#include "feeler/policies/io/policy_check.h"

namespace feeler::policies {
namespace {

constexpr double kTolerance = 1e-9;

bool Agree(double a, double b) { return std::abs(a - b) <= kTolerance * std::max(1.0, std::abs(b)); }

/// The first node whose cost to go is not the mean over its branches of the move's cost and the successor's.
std::string FindCostFault(const planner::PolicyGraph& policy, const CostWeights& cost) {
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    const planner::PolicyNode& node = policy.nodes[i];
    double expected = 0.0;
    for (const planner::PolicyBranch& branch : node.branches) {
      expected +=
          branch.probability * (cost.Of(branch.outcome, node.move.direction) + policy.nodes[branch.next].expected_cost);
    }
    if (!Agree(node.expected_cost, expected)) {
      return fmt::format("node {} stores cost {:.12g}, its branches give {:.12g}", i, node.expected_cost, expected);
    }
  }
  return "";
}

}  // namespace

RowVerification VerifyRow(const StoredProblem& row, const planner::Problem& problem) {
  RowVerification verification;
  if (!row.policy) return verification;
  const planner::PolicyGraph& policy = *row.policy;
  if (const auto fault = FindPolicyFault(policy)) {
    verification.fault = *fault;
    return verification;
  }
  const planner::PolicyEvaluation evaluation = planner::Evaluate(problem, policy);
  verification.replayed_cost = evaluation.expected_cost;
  if (!evaluation.valid()) {
    verification.fault = evaluation.fault;
  } else if (!Agree(row.expected_cost, evaluation.expected_cost)) {
    verification.fault =
        fmt::format("stored cost {:.12g}, replayed {:.12g}", row.expected_cost, evaluation.expected_cost);
  } else if (row.lower_bound > row.expected_cost + kTolerance * std::max(1.0, row.expected_cost)) {
    verification.fault = "the lower bound exceeds the cost";
  } else {
    verification.fault = FindCostFault(policy, problem.cost);
  }
  return verification;
}

}  // namespace feeler::policies
