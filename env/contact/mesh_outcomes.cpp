#include "feeler/env/contact/mesh_outcomes.h"

#include <string>

#include "feeler/core/error.h"

namespace feeler::env {

MeshOutcomes::MeshOutcomes(const TaskModel& task_model, Opening opening, const Eigen::Vector3d& phase,
                           int checks_per_cell)
    : phase_(phase), cell_m_(task_model.task.cell_m), checks_per_cell_(checks_per_cell) {
  if (checks_per_cell < 1) {
    throw InputError("mesh outcomes", std::to_string(checks_per_cell) + " checks per cell", "give at least 1");
  }
  std::vector<int> geoms = task_model.target_geoms;
  if (opening == Opening::kClosed) geoms.insert(geoms.end(), task_model.lid_geoms.begin(), task_model.lid_geoms.end());
  for (const Eigen::Quaterniond& orientation : TargetOrientations(task_model.task)) {
    judges_.emplace_back(task_model, geoms, orientation);
  }
}

Outcome MeshOutcomes::Predict(const Cell& displacement, const GuardedMove& move, int orientation) {
  OverlapJudge& judge = judges_[static_cast<std::size_t>(orientation)];
  const Eigen::Vector3d start_m = (displacement.cast<double>() + phase_) * cell_m_;
  const Eigen::Vector3d step_m = UnitVector(move.direction) * (cell_m_ / checks_per_cell_);
  for (int check = 1; check <= move.cells * checks_per_cell_; ++check) {
    ++checks_;
    if (judge.Overlap(start_m + check * step_m)) return {(check - 1) / checks_per_cell_, true};
  }
  return {move.cells, false};
}

}  // namespace feeler::env
