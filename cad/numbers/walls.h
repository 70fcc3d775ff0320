#pragma once

#include <array>

#include "feeler/cad/numbers/numbers.h"
#include "feeler/env/model/task_file.h"

namespace feeler::cad {

struct MetWalls {
  Walls walls;
  /// Along each axis: whether lines of motion end within the workspace at all, be it at sides that slant or are round.
  std::array<bool, 3> any_side{};
};

/// The walls that guarded moves meet, from the pieces of a loaded task with its opening closed: faces across an axis at
/// which neighbouring lines of motion end alike, within the workspace.
MetWalls WallsOf(const env::TaskModel& task);

/// Half the play of the tool along x and y at a depth below the mouth, as the pieces leave it; at most `most_m`.
Eigen::Vector2d PlayOfPieces(const env::TaskModel& task, double depth_m, double most_m);

}  // namespace feeler::cad
