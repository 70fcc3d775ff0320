#include "feeler/workflow/setup/planning_setup.h"

#include <nlohmann/json.hpp>

#include "feeler/core/json_depth.h"
#include "feeler/env/contact/contact_map_cache.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/planner/family/prior.h"
#include "feeler/workflow/setup/contact_speeds.h"

namespace feeler::workflow {
namespace {

/// Settings name the kind of cost only where it is not distance.
CostKind KindOf(const policies::DatabaseIdentity& identity) {
  const auto settings = ParseJsonText<nlohmann::json>(identity.settings);
  const bool time = settings.is_object() && settings.value("cost", "") == ToString(CostKind::kTime);
  return time ? CostKind::kTime : CostKind::kDistance;
}

/// Settings name the prior only where it is not uniform.
std::vector<double> PriorOf(const policies::DatabaseIdentity& identity) {
  const auto settings = ParseJsonText<nlohmann::json>(identity.settings);
  std::vector<double> prior;
  if (!settings.is_object() || !settings.contains(kPriorSetting)) return prior;
  for (const nlohmann::json& deviation : settings.at(kPriorSetting)) {
    prior.push_back(deviation.is_number() ? deviation.get<double>() : -1.0);
  }
  return prior;
}

}  // namespace

planner::Problem PlanningSetup::ProblemOf(const planner::Extents& extents) const {
  planner::Problem problem = planner::MakeCuboidProblem(task(), map, extents);
  planner::WeighByPrior(task(), prior_deviation, extents, problem);
  return problem;
}

std::string CostUnit(CostKind kind, const CostWeights& cost) {
  if (kind == CostKind::kTime) return "s";
  return cost == CostWeights{} ? "cells" : "weighted";
}

std::string CostUnit(const policies::DatabaseIdentity& identity) { return CostUnit(KindOf(identity), identity.cost); }

PlanningSetupOptions SetupOptionsOf(const policies::DatabaseIdentity& identity) {
  PlanningSetupOptions options;
  options.opening =
      identity.opening == env::ToString(env::Opening::kOpen) ? env::Opening::kOpen : env::Opening::kClosed;
  options.goal = identity.goal == ToString(GoalKind::kInsertable) ? GoalKind::kInsertable : GoalKind::kSingleton;
  options.cost_kind = KindOf(identity);
  options.cost = identity.cost;
  options.prior_deviation = PriorOf(identity);
  return options;
}

PlanningSetup LoadPlanningSetup(const std::string& task, const PlanningSetupOptions& options) {
  PlanningSetup setup;
  setup.model = env::LoadTask(task);
  if (options.goal) setup.model.task.goal = *options.goal;
  if (options.cost) {
    setup.model.task.cost = *options.cost;
  } else if (options.cost_kind == CostKind::kTime) {
    const auto speeds = NominalContactSpeeds(setup.model, setup.task().force_budget_n);
    setup.model.task.cost = speeds ? TimeCost(setup.task(), *speeds) : TimeCost(setup.task());
  }
  setup.cost_kind = options.cost_kind;
  setup.prior_deviation = options.prior_deviation;
  setup.opening = options.opening;
  setup.map = std::make_shared<const planner::ContactMap>(
      env::GetContactMap(setup.model, options.opening, options.jobs, options.progress, options.on_cache_failure));
  setup.fingerprint = env::Fingerprint(setup.model, options.opening);
  return setup;
}

}  // namespace feeler::workflow
