#pragma once

#include <Eigen/Core>

#include "feeler/core/pose.h"
#include "feeler/env/arm/ur10e.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Pose and Jacobian (as ToolJacobian) of the tool frame, for the price of one of them.
struct ToolFrame {
  Pose pose;
  Matrix6 jacobian;
};
ToolFrame ToolKinematics(const Scene& scene, const JointVector& q_rad);

/// Jacobian of the tool frame in the world: rows 0-2 linear velocity of the tool origin (m/rad), rows 3-5 angular.
Matrix6 ToolJacobian(const Scene& scene, const JointVector& q_rad);

/// Displacement (m) and rotation vector (rad) in world axes that take `from` to `to`.
Vector6 PoseError(const Pose& from, const Pose& to);

/// Newton's method from `q_rad` to the joint positions nearby that put the tool at `world_T_tool`, to 1e-10 m and rad.
/// Keeps the branch it starts on. False, with `q_rad` untouched, where it does not converge within `max_change_rad` of
/// any joint or leaves +-2 pi: out of reach, or a singularity on the way.
bool SolveNearby(const Scene& scene, const Pose& world_T_tool, JointVector& q_rad, double max_change_rad = 0.5);

}  // namespace feeler::env
