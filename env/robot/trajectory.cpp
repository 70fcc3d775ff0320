#include "feeler/env/robot/trajectory.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace feeler::env {
namespace {

double AngleBetween(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

double SecondsAtFullPace(const Pose& a, const Pose& b, const CartesianLimits& limits) {
  return std::max((b.translation() - a.translation()).norm() / limits.speed_m_s,
                  AngleBetween(a, b) / limits.angular_speed_rad_s);
}

std::vector<double> PaceOf(const std::vector<Pose>& way_points, const CartesianLimits& limits) {
  assert(!way_points.empty());
  std::vector<double> end(way_points.size(), 0.0);
  for (std::size_t i = 1; i < way_points.size(); ++i) {
    end[i] = end[i - 1] + SecondsAtFullPace(way_points[i - 1], way_points[i], limits);
  }
  return end;
}

// How fast the pace may change: the fastest linear and angular motion on the way decide, each by its own limit.
double PaceChange(const std::vector<Pose>& way_points, const CartesianLimits& limits) {
  double change = 1e9;
  for (std::size_t i = 1; i < way_points.size(); ++i) {
    const Pose& a = way_points[i - 1];
    const Pose& b = way_points[i];
    const double span_s = SecondsAtFullPace(a, b, limits);
    if (span_s == 0) continue;
    const double speed = (b.translation() - a.translation()).norm() / span_s;
    const double angular_speed = AngleBetween(a, b) / span_s;
    if (speed > 0) change = std::min(change, limits.acceleration_m_s2 / speed);
    if (angular_speed > 0) change = std::min(change, limits.angular_acceleration_rad_s2 / angular_speed);
  }
  return change;
}

}  // namespace

TrapezoidalProfile::TrapezoidalProfile(double distance, double velocity, double acceleration)
    : distance_(distance), acceleration_(acceleration) {
  assert(distance >= 0 && velocity > 0 && acceleration > 0);
  const double ramp = velocity / acceleration;
  if (velocity * ramp >= distance) {
    ramp_s_ = std::sqrt(distance / acceleration);
    cruise_s_ = 0.0;
  } else {
    ramp_s_ = ramp;
    cruise_s_ = distance / velocity - ramp;
  }
}

ProfilePoint TrapezoidalProfile::At(double time_s) const {
  const double top = acceleration_ * ramp_s_;
  if (time_s <= 0) return {};
  if (time_s >= duration_s()) return {distance_, 0.0, 0.0};
  if (time_s < ramp_s_) return {acceleration_ * time_s * time_s / 2, acceleration_ * time_s, acceleration_};
  if (time_s < ramp_s_ + cruise_s_) return {top * (time_s - ramp_s_ / 2), top, 0.0};
  const double left = duration_s() - time_s;
  return {distance_ - acceleration_ * left * left / 2, acceleration_ * left, -acceleration_};
}

PoseTrajectory::PoseTrajectory(std::vector<Pose> way_points, const CartesianLimits& limits)
    : way_points_(std::move(way_points)),
      pace_end_(PaceOf(way_points_, limits)),
      profile_(pace_end_.back(), 1.0, PaceChange(way_points_, limits)) {}

PoseTrajectory PoseTrajectory::Slowed(double factor) const {
  assert(factor >= 1);
  PoseTrajectory slower = *this;
  slower.slowness_ *= factor;
  return slower;
}

PosePoint PoseTrajectory::AtPace(double pace) const {
  PosePoint point;
  if (pace >= pace_end_.back()) {
    point.pose = way_points_.back();
    return point;
  }
  const auto next = static_cast<std::size_t>(std::upper_bound(pace_end_.begin(), pace_end_.end(), std::max(pace, 0.0)) -
                                             pace_end_.begin());
  const Pose& a = way_points_[next - 1];
  const Pose& b = way_points_[next];
  const double span = pace_end_[next] - pace_end_[next - 1];
  const double fraction = (std::max(pace, 0.0) - pace_end_[next - 1]) / span;
  const Eigen::AngleAxisd turn(a.linear().transpose() * b.linear());
  const Eigen::Vector3d displacement_m = b.translation() - a.translation();
  point.pose = a;
  point.pose.translation() += fraction * displacement_m;
  if (turn.angle() > 0) {
    point.pose.linear() = a.linear() * Eigen::AngleAxisd(fraction * turn.angle(), turn.axis()).toRotationMatrix();
  }
  point.twist << displacement_m / span, turn.angle() / span * (a.linear() * turn.axis());
  return point;
}

PosePoint PoseTrajectory::At(double time_s) const {
  const ProfilePoint p = profile_.At(time_s / slowness_);
  PosePoint point = AtPace(time_s >= duration_s() ? pace_end_.back() : p.position);
  point.acceleration = point.twist * (p.acceleration / (slowness_ * slowness_));
  point.twist *= p.velocity / slowness_;
  return point;
}

}  // namespace feeler::env
