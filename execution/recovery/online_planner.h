#pragma once

#include <cstdint>
#include <memory>

#include "feeler/planner/belief/problem.h"
#include "feeler/planner/bounds/planning_tables_cache.h"
#include "feeler/policies/policy.h"

namespace feeler::execution {

/// Plans for a belief that no database holds, while the robot waits: with a budget of expansions, not of time, so
/// that the policy is the same wherever and whenever it is computed. The tables of a contact map are built at its first
/// problem and shared by all that follow. Thread-safe.
class OnlinePlanner {
 public:
  explicit OnlinePlanner(std::int64_t expansion_limit = 3000) : expansion_limit_(expansion_limit) {}

  /// A policy for the problem; null if there is none within the budget.
  std::unique_ptr<policies::Policy> PolicyFor(const planner::Problem& problem);

 private:
  std::int64_t expansion_limit_;
  planner::PlanningTablesCache tables_;
};

}  // namespace feeler::execution
