#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "feeler/planner/policy/policy_graph.h"

namespace feeler::planner {

enum class SolverStatus {
  kConverged,
  kGap,
  kTimeLimit,
  kExpansionLimit,
  kCancelled,
  kUnlocalizable,
  kMemoryLimit,
  kRounding
};
/// "converged", "gap", "time_limit", "expansion_limit", "cancelled", "unlocalizable", "memory_limit", "rounding" (the
/// bounds of a general POMDP are as close as its numbers allow).
std::string_view ToString(SolverStatus status);

struct SolverResult {
  SolverStatus status = SolverStatus::kConverged;
  std::optional<PolicyGraph> policy;  ///< the best complete policy; empty if there is none (yet)
  double expected_cost = 0.0;         ///< exact, over every hypothesis; infinity without a policy
  double lower_bound = 0.0;           ///< proven, never inflated
  std::int64_t trials = 0;
  /// Accounts of all attempts at the problem together: where a policy leaves the workspace, there are two.
  std::int64_t expansions = 0;  ///< beliefs whose actions were all evaluated
  double cpu_s = 0.0;           ///< of the solving thread, from the call of `Solve` to its return
  double wall_s = 0.0;
  /// Pairs of indices of hypotheses that no probe tells apart (and the goal needs apart); empty unless unlocalizable.
  std::vector<std::pair<int, int>> indistinguishable;

  bool complete() const { return policy.has_value(); }
  /// Expected cost / lower bound; 1 if both are zero; infinity without a policy.
  double Ratio() const;
};

}  // namespace feeler::planner
