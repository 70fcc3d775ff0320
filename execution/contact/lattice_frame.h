#pragma once

#include <Eigen/Core>

#include "feeler/core/lattice.h"
#include "feeler/core/pose.h"

namespace feeler::execution {

/// Lattice coordinates: continuous positions in cells, in the axes of the estimated target frame, in which hypothesis h
/// is the target at position h, and the tool at lattice cell r stands at r + phase. A displacement of the tool from the
/// target, in cells, is the difference of their coordinates. The estimate (centre of the hypotheses) is at `center`.
struct LatticeFrame {
  Pose world_T_estimate = Pose::Identity();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< (extents - 1) / 2, in cells
  double cell_m = 0.002;

  /// Pose in the world of a frame at lattice coordinates `u`, parallel to the estimated target frame.
  Pose ToWorld(const Eigen::Vector3d& u) const {
    Pose pose = world_T_estimate;
    pose.translation() = world_T_estimate * Eigen::Vector3d((u - center) * cell_m);
    return pose;
  }
  Eigen::Vector3d FromWorld(const Pose& world_T_frame) const {
    return center + world_T_estimate.inverse() * world_T_frame.translation() / cell_m;
  }
  Eigen::Vector3d DirectionInWorld(Direction d) const { return world_T_estimate.linear() * UnitVector(d); }
};

}  // namespace feeler::execution
