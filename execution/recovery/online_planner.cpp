#include "feeler/execution/recovery/online_planner.h"

#include "feeler/planner/solve.h"
#include "feeler/policies/database_policy.h"

namespace feeler::execution {

std::unique_ptr<policies::Policy> OnlinePlanner::PolicyFor(const planner::Problem& problem) {
  // The certified solver has a complete policy at any budget; a better one than this is not worth a robot's waiting.
  planner::SolverOptions options = planner::FastSetting(planner::SolverKind::kCertified, 1.0);
  options.gap = 1.5;
  options.expansion_limit = expansion_limit_;
  options.first_policy_in_any_case = true;
  planner::SolverResult result = planner::Solve(problem, options, tables_.TablesFor(problem, options));
  if (!result.policy) return nullptr;
  return std::make_unique<policies::DatabasePolicy>(
      std::make_shared<const planner::PolicyGraph>(*std::move(result.policy)));
}

}  // namespace feeler::execution
