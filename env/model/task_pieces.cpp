#include "feeler/env/model/task_pieces.h"

#include "feeler/env/model/geom_shapes.h"
#include "feeler/planner/contact/exact_travel.h"

namespace feeler::env {

TaskPieces PiecesOf(const TaskModel& task_model, Opening opening) {
  const mjModel& model = *task_model.model;
  const FeltGeoms geoms = GeomsOf(task_model, opening);
  TaskPieces pieces;
  for (const int geom : geoms.tool) {
    pieces.tool.push_back(PieceOf(model, geom, GeomInBody(model, geom, task_model.tool_body)));
  }
  for (const int geom : geoms.target) {
    if (model.geom_type[geom] == mjGEOM_PLANE) continue;
    pieces.target.push_back(PieceOf(model, geom, GeomInBody(model, geom, task_model.target_body)));
  }
  return pieces;
}

std::unique_ptr<planner::TravelModel> MakeExactTravel(const TaskModel& task_model, Opening opening) {
  TaskPieces pieces = PiecesOf(task_model, opening);
  return std::make_unique<planner::ExactTravel>(pieces.tool, std::move(pieces.target));
}

}  // namespace feeler::env
