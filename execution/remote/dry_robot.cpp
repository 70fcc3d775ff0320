#include "feeler/execution/remote/dry_robot.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace feeler::execution {

namespace {

constexpr double kTouching_m = 1e-6;  // rest this far before a surface
constexpr double kStep_m = 0.0002;    // of lines across the axes
constexpr double kGive_m = 0.0015;    // how far the spring yields

}  // namespace

DryRobot::DryRobot(std::unique_ptr<planner::TravelModel> world, const Pose& world_T_target, const Pose& world_T_tool)
    : world_(std::move(world)), world_T_target_(world_T_target), world_T_tool_(world_T_tool) {}

double DryRobot::Room(Direction direction, const Eigen::Vector3d& offset_m) {
  const Pose tool_T_target = world_T_tool_.inverse() * world_T_target_;
  return world_->Travel(tool_T_target, {{offset_m, direction}}).front();
}

bool DryRobot::Along(int axis, double distance_m) {
  if (distance_m == 0.0) return true;
  const Direction direction = MakeDirection(axis, distance_m < 0.0 ? -1 : 1);
  const double room_m = std::max(0.0, Room(direction) - kTouching_m);
  const double length_m = std::min(std::abs(distance_m), room_m);
  world_T_tool_.translation() += world_T_tool_.linear() * (length_m * UnitVector(direction));
  return length_m == std::abs(distance_m);
}

bool DryRobot::Straight(const Eigen::Vector3d& goal_m) {
  const Eigen::Vector3d way = world_T_tool_.linear().transpose() * (goal_m - world_T_tool_.translation());
  int axis = 0;
  const double longest_m = way.cwiseAbs().maxCoeff(&axis);
  Eigen::Vector3d across = way;
  across[axis] = 0.0;
  const int steps = across.norm() < 1e-9 ? 1 : static_cast<int>(std::ceil(longest_m / kStep_m));
  for (int step = 0; step < steps; ++step) {
    for (int i = 0; i < 3; ++i) {
      if (!Along((axis + i) % 3, way[(axis + i) % 3] / steps)) return false;
    }
  }
  return true;
}

bool DryRobot::GiveWay(Direction direction) {
  const double here_m = Room(direction);
  const int axis = AxisOf(direction);
  for (double radius_m = 0.0001; radius_m <= kGive_m; radius_m += 0.0001) {
    for (int k = 0; k < 16; ++k) {
      const double angle = k * std::numbers::pi / 8.0;
      Eigen::Vector3d aside = Eigen::Vector3d::Zero();
      aside[(axis + 1) % 3] = radius_m * std::cos(angle);
      aside[(axis + 2) % 3] = radius_m * std::sin(angle);
      if (Room(direction, aside) < here_m + 5e-5) continue;
      world_T_tool_.translation() += world_T_tool_.linear() * aside;
      return true;
    }
  }
  return false;
}

MotionResult DryRobot::Report(bool arrived, const Eigen::Vector3d& from_m, double speed_m_s, double force_n) {
  MotionResult result;
  result.reason = arrived ? StopReason::kReached : StopReason::kContact;
  result.contact = !arrived;
  result.peak_force_n = arrived ? 0.0 : force_n;
  result.world_T_tool = world_T_tool_;
  result.travelled_m = (world_T_tool_.translation() - from_m).norm();
  time_s_ += result.travelled_m / speed_m_s;
  return result;
}

MotionResult DryRobot::Transfer(const Pose& world_T_tool) {
  const Eigen::Vector3d from_m = world_T_tool_.translation();
  world_T_tool_ = world_T_tool;  // around obstacles: the way is not of interest here
  return Report(true, from_m, 0.25, 0.0);
}

MotionResult DryRobot::LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) {
  const Eigen::Vector3d from_m = world_T_tool_.translation();
  const bool arrived = Straight(world_T_tool.translation());
  if (arrived) world_T_tool_.linear() = world_T_tool.linear();
  return Report(arrived, from_m, speed_m_s, contact_force_n);
}

MotionResult DryRobot::Guarded(const GuardedMotion& motion) {
  const Eigen::Vector3d from_m = world_T_tool_.translation();
  const bool arrived = Straight(from_m + motion.distance_m * motion.direction);
  return Report(arrived, from_m, motion.speed_m_s, motion.contact_force_n);
}

MotionResult DryRobot::Compliant(const CompliantMotion& motion) {
  const Eigen::Vector3d from_m = world_T_tool_.translation();
  bool arrived = true;
  for (const Pose& goal : motion.world_T_tool) {
    const Eigen::Vector3d way = world_T_tool_.linear().transpose() * (goal.translation() - world_T_tool_.translation());
    int axis = 0;
    way.cwiseAbs().maxCoeff(&axis);
    const Direction direction = MakeDirection(axis, way[axis] < 0.0 ? -1 : 1);
    double left_m = std::abs(way[axis]);
    for (int give = 0; give < 200 && left_m > 1e-7; ++give) {
      const Eigen::Vector3d before = world_T_tool_.translation();
      arrived = Along(axis, SignOf(direction) * left_m);
      left_m -= (world_T_tool_.translation() - before).norm();
      if (arrived || !GiveWay(direction)) break;
    }
  }
  MotionResult result = Report(arrived, from_m, motion.speed_m_s, motion.force_limit_n);
  if (!arrived) result.reason = StopReason::kForceLimit;
  return result;
}

}  // namespace feeler::execution
