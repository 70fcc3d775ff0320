#pragma once

#include <memory>
#include <optional>
#include <string>

#include "core/parallelism.h"
#include "core/progress.h"
#include "core/task.h"
#include "env/contact_map_builder.h"
#include "env/task_file.h"
#include "planner/contact/contact_map.h"

namespace feeler::workflow {

struct PlanningSetupOptions {
  env::Opening opening = env::Opening::kClosed;
  std::optional<GoalKind> goal;  ///< instead of the task file's
  Parallelism jobs;
  ProgressCallback progress;  ///< while the contact map is built; not called when it comes from the cache
};

/// A task with everything that planning for it needs.
struct PlanningSetup {
  env::TaskModel model;
  env::Opening opening = env::Opening::kClosed;
  std::shared_ptr<const planner::ContactMap> map;
  std::string fingerprint;  ///< what a database must have been made for

  const Task& task() const { return model.task; }
};

/// Loads a task by name or path, and its contact map from the cache or from its models. Throws InputError.
PlanningSetup LoadPlanningSetup(const std::string& task, const PlanningSetupOptions& options = {});

}  // namespace feeler::workflow
