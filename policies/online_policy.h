#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "feeler/planner/bounds/planning_tables_cache.h"
#include "feeler/planner/policy/policy_graph.h"
#include "feeler/policies/database_policy.h"
#include "feeler/policies/policy.h"

namespace feeler::policies {

struct OnlineOptions {
  double time_limit_s = 1.0;  ///< per planning step
  /// Instead of the time limit: a budget that gives the same policy wherever it is spent.
  std::optional<std::int64_t> expansion_limit;
  double gap = 1.05;  ///< a policy certified to this needs no further planning
};

/// Plans while the robot waits, for hypothesis sets that no database holds: the certified solver, from the belief at
/// hand, within a budget per step. What was certified to the gap is followed to its end; what the budget cut short is
/// improved at the next step, and replaced only by a policy of lower expected cost, so that the cost to go falls with
/// every step and the episode ends.
class OnlinePolicy final : public Policy {
 public:
  /// `tables` are shared by all policies for a contact map. Throws InputError for a budget that is not positive.
  OnlinePolicy(const OnlineOptions& options, std::shared_ptr<planner::PlanningTablesCache> tables);

  std::string_view name() const override { return "online"; }
  void Begin(const planner::Problem& problem) override;
  Decision Next(const Belief& belief) override;
  bool Observe(const Outcome& outcome) override;

 private:
  void Plan(const Belief& belief);

  OnlineOptions options_;
  std::shared_ptr<planner::PlanningTablesCache> tables_;
  const planner::Problem* problem_ = nullptr;
  std::optional<DatabasePolicy> plan_;  ///< the policy followed, at its present node
  bool certified_ = false;
  bool decided_ = false;  ///< the plan is for the present belief
};

}  // namespace feeler::policies
