#include "execution/online_planner.h"

#include "policies/database_policy.h"

namespace feeler::execution {

std::shared_ptr<const planner::PlanningTables> OnlinePlanner::TablesFor(const planner::Problem& problem,
                                                                        const planner::SolverOptions& options) {
  const std::lock_guard lock(mutex_);
  if (!tables_ || map_ != problem.map || !(cost_ == problem.cost) || goal_ != problem.goal) {
    tables_ = planner::BuildPlanningTables(problem, options);
    map_ = problem.map;
    cost_ = problem.cost;
    goal_ = problem.goal;
  }
  return tables_;
}

std::unique_ptr<policies::Policy> OnlinePlanner::PolicyFor(const planner::Problem& problem) {
  // The certified solver has a complete policy at any budget; a better one than this is not worth a robot's waiting.
  planner::SolverOptions options = planner::FastSetting(planner::SolverKind::kCertified, 1.0);
  options.gap = 1.5;
  options.expansion_limit = expansion_limit_;
  const planner::SolverResult result = planner::Solve(problem, options, TablesFor(problem, options));
  if (!result.policy) return nullptr;
  return std::make_unique<policies::DatabasePolicy>(std::make_shared<const planner::Policy>(*result.policy));
}

}  // namespace feeler::execution
