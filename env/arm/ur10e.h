#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "feeler/core/pose.h"

namespace feeler::env {

inline constexpr int kJointCount = 6;
/// Joint positions (rad), velocities (rad/s), accelerations or torques (Nm), shoulder pan first, wrist 3 last.
using JointVector = Eigen::Matrix<double, kJointCount, 1>;

/// The published Denavit-Hartenberg values of the UR10e (Universal Robots, "DH parameters for calculations of
/// kinematics and dynamics"): standard convention, alpha = (pi/2, 0, 0, pi/2, -pi/2, 0).
struct Ur10eGeometry {
  static constexpr double kD1_m = 0.1807;
  static constexpr double kA2_m = -0.6127;
  static constexpr double kA3_m = -0.57155;
  static constexpr double kD4_m = 0.17415;
  static constexpr double kD5_m = 0.11985;
  static constexpr double kD6_m = 0.11655;
};

/// Joint names in the order of JointVector, as in models/robots/ur10e.urdf.
inline constexpr std::array<const char*, kJointCount> kJointNames = {
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"};

/// base_T_flange: the pose of the flange frame (`tool0`: z out of the flange) in the base frame (`base_link`: z up,
/// x to the front: with the shoulder pan at zero the arm reaches along +x). The Denavit-Hartenberg base frame is
/// `base_link` turned by pi about z.
Pose ForwardKinematics(const JointVector& q_rad);

/// Where the joints' axes are, in the base frame, and the flange behind them.
struct KinematicChain {
  std::array<Eigen::Vector3d, kJointCount> axis;      ///< unit vectors
  std::array<Eigen::Vector3d, kJointCount> origin_m;  ///< a point on each
  Pose base_T_flange;
};
KinematicChain Chain(const JointVector& q_rad);

/// The geometric Jacobian of a point (base frame) that moves with the flange: rows 0-2 linear (m/rad), rows 3-5 angular
/// (rad/rad).
Eigen::Matrix<double, 6, 6> JacobianAt(const KinematicChain& chain, const Eigen::Vector3d& point_m);

/// The geometric Jacobian of the flange origin in the base frame: rows 0-2 linear (m/rad), rows 3-5 angular (rad/rad).
Eigen::Matrix<double, 6, 6> Jacobian(const JointVector& q_rad);

/// All joint positions, each wrapped to (-pi, pi], that put the flange at `base_T_flange`: up to eight (two shoulders,
/// two wrists, two elbows), in a fixed order of branches; coinciding branches are listed once. Empty when the pose is
/// out of reach. At a wrist singularity (the axes of wrist 3 and wrist 1 parallel), where wrist 3 is free, it takes
/// `wrist_3_if_singular_rad`.
std::vector<JointVector> InverseKinematics(const Pose& base_T_flange, double wrist_3_if_singular_rad = 0.0);

/// The angle in (-pi, pi].
double WrapAngle(double angle_rad);

}  // namespace feeler::env
