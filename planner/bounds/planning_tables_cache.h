#pragma once

#include <memory>
#include <mutex>

#include "feeler/planner/bounds/build_tables.h"

namespace feeler::planner {

/// The planning tables of a contact map, built at its first problem and shared by all that follow, as long as map, cost
/// and goal stay the same. Thread-safe.
class PlanningTablesCache {
 public:
  std::shared_ptr<const PlanningTables> TablesFor(const Problem& problem, const SolverOptions& options);

 private:
  std::mutex mutex_;  // guards all below
  std::shared_ptr<const ContactMap> map_;
  CostWeights cost_;
  GoalKind goal_ = GoalKind::kSingleton;
  std::shared_ptr<const PlanningTables> tables_;
};

}  // namespace feeler::planner
