// Straight motions in space: guarded and linear moves, by joint references at every physics step.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "feeler/core/error.h"
#include "feeler/env/robot/motion_arguments.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/env/robot/watched_way.h"

namespace feeler::env {

PoseTrajectory SimulatedRobot::Line(const Pose& goal, double speed_m_s, double acceleration_m_s2) const {
  CartesianLimits limits;
  limits.speed_m_s = speed_m_s;
  limits.acceleration_m_s2 = acceleration_m_s2;
  limits.angular_speed_rad_s = options_.angular_speed_rad_s;
  limits.angular_acceleration_rad_s2 = options_.angular_acceleration_rad_s2;
  return PoseTrajectory({ArmPose(), goal}, limits);
}

std::optional<PoseTrajectory> SimulatedRobot::Reachable(const PoseTrajectory& trajectory) const {
  const Scene& scene = world_.scene();
  constexpr int kSamples = 16;
  JointVector q = q_rad();
  double slowness = 1.0;
  const double pace = trajectory.duration_s() > 0 ? 1.0 / trajectory.duration_s() : 0.0;
  for (int i = 1; i <= kSamples; ++i) {
    const double fraction = static_cast<double>(i) / kSamples;
    if (!SolveNearby(scene, trajectory.PoseAt(fraction), q)) return std::nullopt;
    const PosePoint point = trajectory.At(i == kSamples ? 0.5 / std::max(pace, 1e-9) : fraction / std::max(pace, 1e-9));
    const JointVector speed = ToolJacobian(scene, q).partialPivLu().solve(point.twist);
    if (!speed.allFinite()) return std::nullopt;
    slowness = std::max(slowness, speed.cwiseAbs().cwiseQuotient(scene.velocity_limit_rad_s).maxCoeff());
  }
  return slowness > 1.0 ? trajectory.Slowed(slowness) : trajectory;
}

MotionResult SimulatedRobot::WatchedLine(const Pose& goal, double speed_m_s, double acceleration_m_s2,
                                         const Watch& watch) {
  constexpr double kUnwatched_n = 1e5;  // a contact force that no motion reaches: the way off a wall
  const NoiseOptions& noise = memory_.noise;
  const bool steps_fail = noise.false_stops_per_m > 0.0 || noise.missed_contact > 0.0 || noise.spent_step > 0.0;
  if (!steps_fail || watch.tool_force_n >= kUnwatched_n)
    return FollowLine(Line(goal, speed_m_s, acceleration_m_s2), watch);
  const Pose start = ArmPose();
  const Eigen::Vector3d way_m = goal.translation() - start.translation();
  const double length_m = way_m.norm();
  const WatchedWay way = DrawWatchedWay(noise, length_m, memory_.false_stop_random, memory_.spent_step_random);
  const auto after = [&](double travelled_m) {
    Pose pose = goal;
    if (travelled_m >= length_m) return pose;
    const double share = travelled_m / length_m;
    pose.translation() = start.translation() + share * way_m;
    pose.linear() =
        Eigen::Quaterniond(start.linear()).slerp(share, Eigen::Quaterniond(goal.linear())).toRotationMatrix();
    return pose;
  };
  MotionResult result = FollowLine(Line(after(way.advance_m), speed_m_s, acceleration_m_s2), watch);
  if (result.reason == StopReason::kReached && way.look_m > 0.0) {
    // Were the last steps, which are spent, free? Where they were the tool is back as if it had stayed.
    result = FollowLine(Line(after(way.advance_m + way.look_m), speed_m_s, acceleration_m_s2), watch);
    if (result.reason == StopReason::kReached)
      result = FollowLine(Line(after(way.advance_m), speed_m_s, acceleration_m_s2), {});
  }
  if (result.reason == StopReason::kContact) {
    const double advanced_m = (result.world_T_tool.translation() - start.translation()).norm();
    MissContact(way.StepsLeft(advanced_m), noise.step_m / speed_m_s, result);
  } else if (result.reason == StopReason::kReached && Stay(way.spent_m / speed_m_s, result) && way.false_contact) {
    result.reason = StopReason::kContact;
    result.contact = true;
  }
  return result;
}

void SimulatedRobot::MissContact(int steps_left, double step_s, MotionResult& result) {
  int missed = 0;
  while (memory_.noise.missed_contact > 0.0 && missed < steps_left &&
         memory_.missed_contact_random.Uniform() < memory_.noise.missed_contact) {
    ++missed;
  }
  if (!Stay(missed * step_s, result) || missed < steps_left) return;
  result.reason = StopReason::kReached;
  result.contact = false;
}

MotionResult SimulatedRobot::FollowLine(const PoseTrajectory& wanted, const Watch& watch) {
  const auto trajectory = Reachable(wanted);
  if (!trajectory) {
    MotionResult result;
    result.reason = StopReason::kUnplanned;
    result.detail = "the straight line leaves the reach of the arm";
    result.world_T_tool = ToolPose();
    return result;
  }
  memory_.set_point.reset();
  memory_.held_orientation = trajectory->goal().linear();
  JointVector q = q_rad();
  const Scene& scene = world_.scene();
  const auto reference_at = [&](double t) -> std::optional<JointReference> {
    const PosePoint point = trajectory->At(t);
    if (!SolveNearby(scene, point.pose, q)) return std::nullopt;
    const Eigen::PartialPivLU<Matrix6> jacobian(ToolJacobian(scene, q));
    JointReference reference;
    reference.q_rad = q;
    reference.qd_rad_s = jacobian.solve(point.twist);
    // The change of the Jacobian is left out: at 0.25 m/s it is worth less than 20 micrometres.
    reference.qdd_rad_s2 = jacobian.solve(point.acceleration);
    return reference;
  };
  return Follow(trajectory->duration_s(), reference_at, watch, true);
}

MotionResult SimulatedRobot::Guarded(const GuardedMotion& motion) {
  const double length = motion.direction.norm();
  if (!motion.direction.allFinite() || std::abs(length - 1.0) > 1e-6) {
    throw InputError("guarded move", "the direction is not a unit vector", "normalise it");
  }
  if (!(motion.distance_m >= 0) || !std::isfinite(motion.distance_m)) {
    throw InputError("guarded move", fmt::format("the distance is {} m", motion.distance_m), "give zero or more");
  }
  RequirePositive(motion.speed_m_s, "guarded move", "the speed (m/s)");
  RequirePositive(motion.contact_force_n, "guarded move", "the contact force (N)");
  return Guard([&] {
    const Pose start = ToolPose();
    Pose goal = ArmPose();
    goal.translation() += motion.distance_m * motion.direction;
    goal.linear() = memory_.held_orientation;
    Watch watch;
    watch.tool_force_n = motion.contact_force_n;
    watch.direction = motion.direction;
    const double acceleration_m_s2 = std::min(options_.acceleration_m_s2, motion.speed_m_s / options_.guarded_ramp_s);
    MotionResult result = WatchedLine(goal, motion.speed_m_s, acceleration_m_s2, watch);
    result.travelled_m = (result.world_T_tool.translation() - start.translation()).dot(motion.direction);
    return result;
  });
}

MotionResult SimulatedRobot::LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) {
  RequirePose(world_T_tool, "linear move");
  RequirePositive(speed_m_s, "linear move", "the speed (m/s)");
  RequirePositive(contact_force_n, "linear move", "the contact force (N)");
  return Guard([&] {
    const Pose start = ToolPose();
    const Eigen::Vector3d way = world_T_tool.translation() - ArmPose().translation();
    Watch watch;
    watch.tool_force_n = contact_force_n;
    if (way.norm() > 1e-9) watch.direction = way.normalized();
    MotionResult result = WatchedLine(world_T_tool, speed_m_s, options_.acceleration_m_s2, watch);
    result.travelled_m = (result.world_T_tool.translation() - start.translation()).dot(watch.direction);
    return result;
  });
}

}  // namespace feeler::env
