#include "feeler/cad/align/play.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace feeler::cad {
namespace {

constexpr double kMostRoll = 3 * kDegree;
/// A tool that stands on the floor is judged a little above it.
constexpr double kLift_m = 2e-5;

}  // namespace

Eigen::Matrix3d Roll(double angle) {
  Eigen::Matrix3d rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (double& value : rotation.reshaped()) {
    if (std::abs(value - std::round(value)) < 1e-12) value = std::round(value);
  }
  return rotation;
}

Pose FrameOf(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& offset) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  pose.translation() = offset;
  return pose;
}

/// Puts the tool into the middle of its play across; false when it has too much or none.
bool Center(const MeshSlide& slide, double most_m, Eigen::Vector3d& offset, double& slack_m) {
  for (int round = 0; round < 3; ++round) {
    slack_m = 0;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
      const double up = slide.Travel(offset, unit, most_m);
      const double down = slide.Travel(offset, -unit, most_m);
      if (up >= most_m || down >= most_m) return false;
      offset += 0.5 * (up - down) * unit;
      slack_m = std::max(slack_m, 0.5 * (up + down));
    }
  }
  return slack_m > 2e-7;
}

void CenterRoll(const TriangleMesh& tool, const MeshTree& target, const Eigen::Vector2d& middle,
                Eigen::Vector3d& offset, double& roll_rad) {
  const Eigen::Vector3d pivot(middle.x(), middle.y(), 0);
  const auto offset_at = [&](double more) -> Eigen::Vector3d { return pivot + Roll(more) * (offset - pivot); };
  const auto free = [&](double more) {
    Pose turn = Pose::Identity();
    turn.linear() = Roll(roll_rad + more);
    const TriangleMesh turned = Transformed(tool, turn);
    return !MeshSlide(turned, target).Overlap(offset_at(more) + kLift_m * Eigen::Vector3d::UnitZ());
  };
  if (!free(0)) return;
  double ends[2] = {0, 0};
  for (int side = 0; side < 2; ++side) {
    const double sign = side == 0 ? 1 : -1;
    double in = 0;
    double out = 0.1 * kDegree;
    while (out < kMostRoll && free(sign * out)) {
      in = out;
      out *= 1.5;
    }
    if (out >= kMostRoll) return;
    while (out - in > 1e-3 * kDegree) {
      const double between = 0.5 * (in + out);
      (free(sign * between) ? in : out) = between;
    }
    ends[side] = sign * in;
  }
  const double more = 0.5 * (ends[0] + ends[1]);
  offset = offset_at(more);
  roll_rad += more;
  const Eigen::Vector3d before = offset;
  double slack = 0;
  Pose turn = Pose::Identity();
  turn.linear() = Roll(roll_rad);
  const TriangleMesh turned = Transformed(tool, turn);
  const MeshSlide slide(turned, target);
  Eigen::Vector3d lifted = offset + kLift_m * Eigen::Vector3d::UnitZ();
  const double most = kMostSlack * BoundsOf(turned).sizes().head<2>().minCoeff();
  offset = Center(slide, most, lifted, slack) ? Eigen::Vector3d(lifted.x(), lifted.y(), offset.z()) : before;
}

}  // namespace feeler::cad
