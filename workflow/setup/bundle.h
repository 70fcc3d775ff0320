#pragma once

#include <string>

#include "feeler/policies/storage/task_bundle.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::workflow {

/// What an executor without a simulator needs of a task (policies/storage/task_bundle.h).
policies::TaskBundle BundleOf(const PlanningSetup& setup);

/// Writes the bundle beside the database at `database` unless the one that lies there serves it already. Throws
/// InputError if it cannot be written.
void KeepBundle(const PlanningSetup& setup, const std::string& database);

}  // namespace feeler::workflow
