#pragma once

#include <memory>
#include <mutex>

#include "planner/solver/solve.h"

namespace feeler::policies {

/// The planning tables of a contact map, built at its first problem and shared by all that follow, as long as map, cost
/// and goal stay the same. Thread-safe.
class PlanningTablesCache {
 public:
  std::shared_ptr<const planner::PlanningTables> TablesFor(const planner::Problem& problem,
                                                           const planner::SolverOptions& options);

 private:
  std::mutex mutex_;  // guards all below
  std::shared_ptr<const planner::ContactMap> map_;
  CostWeights cost_;
  GoalKind goal_ = GoalKind::kSingleton;
  std::shared_ptr<const planner::PlanningTables> tables_;
};

}  // namespace feeler::policies
