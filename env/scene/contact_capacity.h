#pragma once

#include "feeler/env/model/task_file.h"

namespace feeler::env {

/// Room for contacts between tool and target at once.
struct ContactCapacity {
  int contacts = 0;  ///< nconmax
  int rows = 0;      ///< njmax: four a contact (elliptic cone, condim 4), and what the robot's joints take
};

/// What a tool can meet at once, from the bounding boxes of its pieces and the target's: on each side of each piece of
/// the target, and inside the opening at some depths; faces of boxes meet in four points, other pairs in one.
/// Between the defaults of SceneOptions, which serve parts of a few boxes, and what memory allows (mjData grows with
/// the square of the rows: 130 MB at 4000).
ContactCapacity CapacityFor(const TaskModel& task_model);

}  // namespace feeler::env
