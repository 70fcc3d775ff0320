#pragma once

#include <string>
#include <vector>

#include "feeler/env/model/task_file.h"
#include "feeler/env/model/task_finding.h"

namespace feeler::workflow {

/// What the arm says to a task: how it holds the tool, what it weighs, whether start and inserted pose are within reach
/// for all places of the target in the box of these extents (one per axis of the task), whether the start is clear
/// enough for the end of a transfer.
env::TaskFindings RobotFindings(const env::TaskModel& task_model, const std::vector<int>& extents,
                                const std::string& where);

}  // namespace feeler::workflow
