#pragma once

#include <Eigen/Geometry>
#include <string>

#include "feeler/core/error.h"
#include "feeler/core/pose.h"

namespace feeler::execution {

[[noreturn]] inline void RefuseMessage(const std::string& what) {
  throw InputError("robot message", what, "both ends must speak docs/robot-protocol.md, version 1");
}

/// A pose whose rotation came over the wire: exactly what was sent if it is a rotation to 1e-9, made orthonormal if it
/// is one to 1e-4, else refused.
inline Pose SoundPose(const Pose& sent) {
  if (!sent.matrix().allFinite()) RefuseMessage("a pose is not finite");
  const Eigen::Matrix3d& r = sent.linear();
  const double error = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error < 1e-4) || r.determinant() < 0.0) RefuseMessage("the rotation of a pose is no rotation");
  return error < 1e-9 ? sent : MakePose(sent.translation(), Eigen::Quaterniond(r));
}

/// Exactly a unit vector to 1e-9, else refused beyond 1e-3.
inline Eigen::Vector3d SoundDirection(const Eigen::Vector3d& sent) {
  const double length = sent.norm();
  if (!(length > 0.999 && length < 1.001)) RefuseMessage("a direction is no unit vector");
  return std::abs(length - 1.0) < 1e-9 ? sent : Eigen::Vector3d(sent / length);
}

}  // namespace feeler::execution
