#include "policies/planning_tables_cache.h"

namespace feeler::policies {

std::shared_ptr<const planner::PlanningTables> PlanningTablesCache::TablesFor(const planner::Problem& problem,
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

}  // namespace feeler::policies
