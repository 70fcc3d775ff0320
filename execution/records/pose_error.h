#pragma once

#include "feeler/core/pose.h"
#include "feeler/core/task.h"

namespace feeler::execution {

/// One pose of a target against another, usually the final estimate against the truth.
struct PoseError {
  double lateral_m = 0.0;          ///< across the insertion axis
  double largest_lateral_m = 0.0;  ///< along the worse of the two axes across it: what the tolerance is about
  double vertical_m = 0.0;         ///< along the insertion axis
  double angle_rad = 0.0;          ///< of the turns that matter to the insertion (InsertionAngle)
  Eigen::Vector3d across_m = Eigen::Vector3d::Zero();  ///< per axis of the target, none along the insertion
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  ///< about the axes of the target, of the turns that matter
};

/// Of the turn from one orientation to the other, 0 to pi.
double AngleBetween(const Pose& a, const Pose& b);

/// How far `pose` is from `reference`, in the axes of `reference`.
PoseError PoseErrorOf(const Task& task, const Pose& reference, const Pose& pose);

/// What counts as localized.
bool WithinTolerance(const Tolerance& tolerance, const PoseError& error);

}  // namespace feeler::execution
