#pragma once

#include <memory>
#include <vector>

#include "feeler/env/model/task_file.h"
#include "feeler/planner/contact/convex_shape.h"
#include "feeler/planner/contact/travel_model.h"

namespace feeler::env {

/// The convex geoms of a task as data. Planes of the target are left out.
struct TaskPieces {
  std::vector<planner::ConvexPiece> tool;    ///< in the tool frame
  std::vector<planner::ConvexPiece> target;  ///< in the target frame
};
TaskPieces PiecesOf(const TaskModel& task_model, Opening opening);

/// Travel from the geoms of a task (planner/contact/exact_travel.h). Planes of the target are not taken into account.
std::unique_ptr<planner::TravelModel> MakeExactTravel(const TaskModel& task_model, Opening opening);

}  // namespace feeler::env
