#pragma once

#include <Eigen/Core>
#include <array>

#include "feeler/env/model/overlap_judge.h"
#include "feeler/env/model/task_file.h"

namespace feeler::env {

/// How far the aligned tool, just inside the mouth, may move towards each side of each axis of the target before it
/// touches, m; infinite along the insertion and where nothing is within 2 cm.
std::array<std::array<double, 2>, 3> ClearanceAtMouth(const TaskModel& task_model);

/// Whether the tool just inside the mouth is free wherever it is displaced by at most this along each axis of the
/// target (m; of the insertion axis none).
bool EntersDisplaced(OverlapJudge& judge, const Task& task, const Eigen::Vector3d& lateral_m);

/// The largest lateral tolerance, the same along both axes, with which the tool still enters the mouth, m.
double LargestLateralOnBoth(const TaskModel& task_model);

/// The largest lateral tolerance per axis of the target, m: in proportion to what each axis alone allows, as far as the
/// tool enters displaced along both at once. The insertion axis counts for nothing.
Eigen::Vector3d LargestLateralTolerance(const TaskModel& task_model);

/// Fills in the tolerances that a task file does not give (NaN): across the insertion what enters the mouth, about the
/// axes across it the tilt that takes up the clearance over the depth, about it the turn that takes it up at the rim of
/// the tool; turns within 0.01 and 0.05 rad, which is what a good gripper holds.
void DeriveTolerances(TaskModel& task_model);

}  // namespace feeler::env
