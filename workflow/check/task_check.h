#pragma once

#include <string>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/model/task_finding.h"

namespace feeler::workflow {

struct TaskCheckOptions {
  env::Opening opening = env::Opening::kClosed;  ///< while localizing
  std::string table;                             ///< an uncertainty table of the task; empty: none
  bool touch = true;  ///< ask the contact map what touch tells apart: minutes for large tasks
  Parallelism jobs;
  ProgressCallback progress;  ///< while contact maps are built
};

/// Of the task's smallest problem, and of its largest: hypotheses per axis.
std::vector<int> SmallestExtents(const Task& task);
std::vector<int> LargestExtents(const Task& task);

/// What can be said about a task without a contact map: lids, how the robot holds the tool, its weight, whether the arm
/// reaches the start and the inserted pose, whether a transfer may end at the start, for the box of these extents.
env::TaskFindings QuickFindings(const env::TaskModel& task_model, env::Opening opening,
                                const std::vector<int>& extents);

/// Everything that may be wrong with a task (docs/task-file.md): settings that change contact, meshes, geometry against
/// numbers, what QuickFindings says, hypotheses that no touch tells apart (with the workspace that would, or the policy
/// that inserts all the same), a calibration that the task caps. Throws InputError where the task cannot be read.
env::TaskFindings CheckTask(const std::string& task, const TaskCheckOptions& options);

/// True if one of them prevents work.
bool Prevents(const env::TaskFindings& findings);

}  // namespace feeler::workflow
