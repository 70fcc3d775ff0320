#pragma once

#include <cstdint>
#include <vector>

#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/env/model/overlap_judge.h"
#include "feeler/env/model/task_file.h"
#include "feeler/planner/contact/outcome_model.h"

namespace feeler::env {

/// Outcomes by collision checks of the meshes, as planners without a contact map compute them: the tool is put at
/// places along its way, and MuJoCo's collision detection is asked at each of them whether it overlaps the target.
///
/// Law: the outcome is that of the contact map, but for obstacles thinner than the distance between two checks, and for
/// walls within a rounding error of a lattice plane.
class MeshOutcomes final : public planner::OutcomeModel {
 public:
  /// `phase`: of the lattice, cells (planner::ContactMap::phase). `checks_per_cell`: at least 1.
  MeshOutcomes(const TaskModel& task_model, Opening opening, const Eigen::Vector3d& phase, int checks_per_cell = 2);

  Outcome Predict(const Cell& displacement, const GuardedMove& move, int orientation) override;

  /// Collision checks (of all pairs of geoms) made so far.
  std::int64_t checks() const { return checks_; }

 private:
  std::vector<OverlapJudge> judges_;  ///< one per orientation
  Eigen::Vector3d phase_;
  double cell_m_;
  int checks_per_cell_;
  std::int64_t checks_ = 0;
};

}  // namespace feeler::env
