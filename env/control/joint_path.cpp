#include "env/control/joint_path.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace feeler::env {

JointPathTrajectory::JointPathTrajectory(std::vector<JointVector> way_points, const JointLimits& limits)
    : way_points_(std::move(way_points)), start_s_{0.0} {
  assert(!way_points_.empty());
  for (std::size_t i = 1; i < way_points_.size(); ++i) {
    const JointVector extent = (way_points_[i] - way_points_[i - 1]).cwiseAbs().cwiseMax(1e-9);
    segments_.emplace_back(1.0, limits.velocity_rad_s.cwiseQuotient(extent).minCoeff(),
                           limits.acceleration_rad_s2.cwiseQuotient(extent).minCoeff());
    start_s_.push_back(start_s_.back() + segments_.back().duration_s());
  }
}

JointReference JointPathTrajectory::At(double time_s) const {
  JointReference reference;
  if (time_s >= duration_s()) {
    reference.q_rad = way_points_.back();
    return reference;
  }
  const auto next = static_cast<std::size_t>(std::upper_bound(start_s_.begin(), start_s_.end(), std::max(time_s, 0.0)) -
                                             start_s_.begin());
  const JointVector extent = way_points_[next] - way_points_[next - 1];
  const ProfilePoint p = segments_[next - 1].At(time_s - start_s_[next - 1]);
  reference.q_rad = way_points_[next - 1] + p.position * extent;
  reference.qd_rad_s = p.velocity * extent;
  reference.qdd_rad_s2 = p.acceleration * extent;
  return reference;
}

}  // namespace feeler::env
