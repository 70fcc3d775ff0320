#pragma once

#include "feeler/core/task.h"

namespace feeler::workflow {

/// Uncertain along x, y and z; stands turned, so that axes of the target are none of the world.
inline Task ThreeAxisTask() {
  Task task;
  task.axes = {{AxisKind::kX}, {AxisKind::kY}, {AxisKind::kZ}};
  task.world_T_target = MakePose({0.6, 0.1, 0.2}, 0.3);
  return task;
}

}  // namespace feeler::workflow
