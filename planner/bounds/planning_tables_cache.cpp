#include "feeler/planner/bounds/planning_tables_cache.h"

namespace feeler::planner {

std::shared_ptr<const PlanningTables> PlanningTablesCache::TablesFor(const Problem& problem,
                                                                     const SolverOptions& options) {
  const std::lock_guard lock(mutex_);
  if (!tables_ || map_ != problem.map || !(cost_ == problem.cost) || goal_ != problem.goal) {
    tables_ = BuildPlanningTables(problem, options);
    map_ = problem.map;
    cost_ = problem.cost;
    goal_ = problem.goal;
  }
  return tables_;
}

}  // namespace feeler::planner
