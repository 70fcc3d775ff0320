#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace feeler {

/// A rigid transform; positions in metres. `world_T_tool` maps tool coordinates to world coordinates.
using Pose = Eigen::Isometry3d;

inline Pose MakePose(const Eigen::Vector3d& position_m, const Eigen::Quaterniond& orientation) {
  Pose pose = Pose::Identity();
  pose.linear() = orientation.normalized().toRotationMatrix();
  pose.translation() = position_m;
  return pose;
}

/// Rotation about z by `yaw_rad`, at a position in metres.
inline Pose MakePose(const Eigen::Vector3d& position_m, double yaw_rad = 0.0) {
  return MakePose(position_m, Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())));
}

/// Force in newtons and torque in newton metres that the world exerts on the tool, at the tool origin, in world axes.
struct Wrench {
  Eigen::Vector3d force_n = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque_nm = Eigen::Vector3d::Zero();
};

}  // namespace feeler
