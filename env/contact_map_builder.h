#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "core/parallelism.h"
#include "core/progress.h"
#include "env/task_file.h"
#include "planner/contact/contact_map.h"

namespace feeler::env {

/// Whether the opening of the target is closed by its lid geoms in the contact map.
enum class Opening { kClosed, kOpen };
std::string_view ToString(Opening opening);

/// The contact map of a task from its geometry: one layer per orientation of `TargetOrientations`.
///
/// Travel is exact along the whole line of motion (to about 1e-3 cells), not sampled at lattice points. Collision is
/// judged by MuJoCo's detection on the compiled geoms. Same result, bit for bit, at any thread count.
/// Throws InputError when a geom type is not supported or the start pose of a problem of the task collides.
planner::ContactMap BuildContactMap(const TaskModel& task_model, Opening opening, Parallelism parallelism = {},
                                    const ProgressCallback& progress = {});

/// Orientations of the target relative to the estimate, lexicographic in the angular axes of the task (one identity if
/// there are none), at their largest extents: Rz(yaw) * Ry(pitch), each angle (k - (n - 1)/2) * resolution.
std::vector<Eigen::Quaterniond> TargetOrientations(const Task& task);

}  // namespace feeler::env
