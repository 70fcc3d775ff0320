#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/core/task.h"
#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/env/model/task_file.h"
#include "feeler/planner/contact/contact_map.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/policies/storage/database.h"

namespace feeler::workflow {

struct PlanningSetupOptions {
  env::Opening opening = env::Opening::kClosed;
  std::optional<GoalKind> goal;              ///< instead of the task file's
  CostKind cost_kind = CostKind::kDistance;  ///< time: the weights that the times of the task come to
  std::optional<CostWeights> cost;           ///< instead of either
  std::vector<double> prior_deviation;       ///< PlanningSetup::prior_deviation
  Parallelism jobs;
  ProgressCallback progress;  ///< while the contact map is built; not called when it comes from the cache
  std::function<void(const std::string& reason)> on_cache_failure;  ///< the contact map could not be kept
};

/// A task with everything that planning for it needs.
struct PlanningSetup {
  env::TaskModel model;
  env::Opening opening = env::Opening::kClosed;
  std::shared_ptr<const planner::ContactMap> map;
  CostKind cost_kind = CostKind::kDistance;  ///< what model.task.cost counts
  std::string fingerprint;                   ///< what a database must have been made for
  /// Of the target's place about its estimate along each uncertain axis (WeighByPrior); empty: equally likely.
  std::vector<double> prior_deviation;

  const Task& task() const { return model.task; }
  /// The problem of these extents, weighed by the prior.
  planner::Problem ProblemOf(const planner::Extents& extents) const;
};

/// The unit of a cost: "s" if the weights are times, "cells" if only distance counts, one a cell; else "weighted".
std::string CostUnit(CostKind kind, const CostWeights& cost);
/// That of the costs in a database.
std::string CostUnit(const policies::DatabaseIdentity& identity);

/// The entry of a database's settings that holds the prior of its problems, where that is not uniform.
inline constexpr const char* kPriorSetting = "prior_deviation";

/// The options that give the setup a database was made for: its opening, goal, costs and prior. Whether model and
/// lattice are the same is for the fingerprint to say.
PlanningSetupOptions SetupOptionsOf(const policies::DatabaseIdentity& identity);

/// Loads a task by name or path, and its contact map from the cache or from its models. Throws InputError.
PlanningSetup LoadPlanningSetup(const std::string& task, const PlanningSetupOptions& options = {});

}  // namespace feeler::workflow
