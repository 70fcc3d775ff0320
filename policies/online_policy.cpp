#include "feeler/policies/online_policy.h"

#include <cassert>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/solve.h"

namespace feeler::policies {

OnlinePolicy::OnlinePolicy(const OnlineOptions& options, std::shared_ptr<planner::PlanningTablesCache> tables)
    : options_(options), tables_(std::move(tables)) {
  if (!(std::isfinite(options.time_limit_s) && options.time_limit_s > 0.0)) {
    throw InputError("online", "the time limit is not positive", "give seconds per step");
  }
  if (options.expansion_limit && *options.expansion_limit < 1) {
    throw InputError("online", "the expansion limit is below 1", "give expansions per step");
  }
  if (!(options.gap >= 1.0)) throw InputError("online", "the gap is below 1", "give 1 or more");
}

void OnlinePolicy::Begin(const planner::Problem& problem) {
  problem_ = &problem;
  plan_.reset();
  certified_ = false;
  decided_ = false;
}

void OnlinePolicy::Plan(const Belief& belief) {
  planner::Problem here = *problem_;
  here.start = belief.robot;
  here.hypotheses = belief.hypotheses;
  planner::SolverOptions options = planner::FastSetting(planner::SolverKind::kCertified, 1.0);
  options.gap = options_.gap;
  options.first_policy_in_any_case = true;  // the robot stands waiting
  if (options_.expansion_limit) {
    options.expansion_limit = *options_.expansion_limit;
  } else {
    options.time_limit_s = options_.time_limit_s;
  }
  planner::SolverResult result = planner::Solve(here, options, tables_->TablesFor(*problem_, options));
  if (!result.policy) return;
  if (plan_ && plan_->node().expected_cost <= result.expected_cost) return;
  plan_.emplace(std::make_shared<const planner::PolicyGraph>(*std::move(result.policy)));
  plan_->Begin(here);
  certified_ = result.status == planner::SolverStatus::kGap || result.status == planner::SolverStatus::kConverged;
}

Decision OnlinePolicy::Next(const Belief& belief) {
  assert(problem_ != nullptr);
  if (planner::IsGoal(*problem_, belief.hypotheses)) return Insert{};
  if (!decided_ && !certified_) Plan(belief);
  decided_ = true;
  if (!plan_) return GiveUp{"no policy within the budget"};
  return plan_->Next(belief);
}

bool OnlinePolicy::Observe(const Outcome& outcome) {
  if (!plan_ || !plan_->Observe(outcome)) {
    // The belief holds what its executor settled on: a plan for it is made at the next step.
    plan_.reset();
    certified_ = false;
  }
  decided_ = false;
  return true;
}

}  // namespace feeler::policies
