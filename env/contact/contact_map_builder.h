#pragma once

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/env/model/task_file.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::env {

/// The contact map of a task from its geometry: one layer per orientation of `TargetOrientations`
/// (env/model/task_file.h).
///
/// Travel is exact along the whole line of motion (to about 1e-3 cells), not sampled at lattice points. Collision is
/// judged by MuJoCo's detection on the compiled geoms. Same result, bit for bit, at any thread count.
/// Throws InputError when a geom type is not supported or the start pose of a problem of the task collides.
planner::ContactMap BuildContactMap(const TaskModel& task_model, Opening opening, Parallelism parallelism = {},
                                    const ProgressCallback& progress = {});

}  // namespace feeler::env
