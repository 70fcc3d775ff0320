#pragma once

#include "feeler/cad/numbers/numbers.h"
#include "feeler/env/model/task_file.h"

namespace feeler::cad {

/// The walls that guarded moves meet, from the pieces of a loaded task with its opening closed: faces across an axis at
/// which neighbouring lines of motion end alike, within the workspace.
Walls WallsOf(const env::TaskModel& task);

/// Half the play of the tool along x and y at a depth below the mouth, as the pieces leave it; at most `most_m`.
Eigen::Vector2d PlayOfPieces(const env::TaskModel& task, double depth_m, double most_m);

}  // namespace feeler::cad
