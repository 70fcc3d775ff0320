#pragma once

#include <string>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/env/model/task_finding.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::workflow {

/// Whether touch tells all hypotheses of the largest problem apart; where it does not: by which workspace it would, and
/// where by none, which axes it is blind to and whether the spiral inserts all the same (tried in simulation).
env::TaskFindings TouchFindings(const PlanningSetup& setup, const std::string& where, Parallelism jobs,
                                const ProgressCallback& progress);

}  // namespace feeler::workflow
