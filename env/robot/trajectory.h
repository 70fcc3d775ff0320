#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "feeler/core/pose.h"

namespace feeler::env {

/// Where a profile stands at a moment.
struct ProfilePoint {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
};

/// From rest to rest over a distance: constant acceleration, constant velocity, constant deceleration (a triangle
/// when the distance is short).
class TrapezoidalProfile {
 public:
  /// `distance` >= 0; `velocity` and `acceleration` > 0, all in the same unit of length.
  TrapezoidalProfile(double distance, double velocity, double acceleration);
  double duration_s() const { return 2 * ramp_s_ + cruise_s_; }
  /// Clamped to the ends outside [0, duration].
  ProfilePoint At(double time_s) const;

 private:
  double distance_;
  double acceleration_;
  double ramp_s_;
  double cruise_s_;
};

/// A pose with the twist and its derivative of the frame, in world axes.
struct PosePoint {
  Pose pose = Pose::Identity();
  Eigen::Matrix<double, 6, 1> twist = Eigen::Matrix<double, 6, 1>::Zero();         ///< m/s, rad/s
  Eigen::Matrix<double, 6, 1> acceleration = Eigen::Matrix<double, 6, 1>::Zero();  ///< m/s^2, rad/s^2
};

/// Speeds and accelerations of a straight Cartesian motion.
struct CartesianLimits {
  double speed_m_s = 0.05;
  double acceleration_m_s2 = 1.0;
  double angular_speed_rad_s = 1.0;
  double angular_acceleration_rad_s2 = 5.0;
};

/// Way points joined by straight lines of the origin and shortest turns of the axes, from rest to rest under one
/// trapezoidal profile: along each segment the slower of the two motions sets the pace. Corners are passed at speed, so
/// a motion that must not cut or jerk at them is made of several trajectories.
class PoseTrajectory {
 public:
  /// `way_points`: at least one.
  PoseTrajectory(std::vector<Pose> way_points, const CartesianLimits& limits);
  double duration_s() const { return profile_.duration_s() * slowness_; }
  PosePoint At(double time_s) const;
  /// The pose at a fraction of the way (in time at full pace) in [0, 1].
  Pose PoseAt(double fraction) const { return AtPace(fraction * pace_end_.back()).pose; }
  const Pose& goal() const { return way_points_.back(); }
  /// The same motion, slower by a factor >= 1.
  PoseTrajectory Slowed(double factor) const;

 private:
  PosePoint AtPace(double pace) const;

  std::vector<Pose> way_points_;
  std::vector<double> pace_end_;  ///< per way point: seconds from the first at full pace
  TrapezoidalProfile profile_;    ///< of the pace
  double slowness_ = 1.0;
};

}  // namespace feeler::env
