// Motions that give way: Cartesian impedance along way points.
#include <fmt/format.h>

#include <cmath>

#include "feeler/core/error.h"
#include "feeler/env/robot/motion_arguments.h"
#include "feeler/env/robot/simulated_robot.h"

namespace feeler::env {

bool SimulatedRobot::GoesOn(const std::vector<Pose>& way_points) const {
  constexpr double kSame = 1e-6;
  const auto& end = memory_.compliant_end;
  return way_points.size() > 1 && end && end->time_s == world_.time_s() &&
         (way_points.front().matrix() - end->world_T_tool.matrix()).norm() < kSame;
}

MotionResult SimulatedRobot::Compliant(const CompliantMotion& motion) {
  if (motion.world_T_tool.empty()) throw InputError("compliant motion", "no way points", "give at least one pose");
  for (const Pose& pose : motion.world_T_tool) RequirePose(pose, "compliant motion");
  RequirePositive(motion.speed_m_s, "compliant motion", "the speed (m/s)");
  RequirePositive(motion.force_limit_n, "compliant motion", "the force limit (N)");
  RequirePositive(motion.time_limit_s, "compliant motion", "the time limit (s)");
  RequirePositive(motion.stiffness_n_m.minCoeff(), "compliant motion", "the smallest stiffness (N/m)");
  RequirePositive(motion.stiffness_n_m.maxCoeff(), "compliant motion", "the largest stiffness (N/m)");
  RequirePositive(motion.rotational_stiffness_nm_rad, "compliant motion", "the rotational stiffness (Nm/rad)");
  if (!(motion.rest_time_s >= 0.0)) {
    throw InputError("compliant motion", fmt::format("the time at rest is {} s", motion.rest_time_s),
                     "give zero or more");
  }
  return Guard([&] {
    const Pose start = ToolPose();
    std::vector<Pose> way_points = motion.world_T_tool;
    if (!GoesOn(way_points)) way_points.insert(way_points.begin(), ArmPose());
    memory_.compliant_end.reset();
    CartesianLimits limits;
    limits.speed_m_s = motion.speed_m_s;
    limits.acceleration_m_s2 = options_.acceleration_m_s2;
    limits.angular_speed_rad_s = options_.angular_speed_rad_s;
    limits.angular_acceleration_rad_s2 = options_.angular_acceleration_rad_s2;
    const PoseTrajectory trajectory(way_points, limits);
    ImpedanceGains gains;
    gains.stiffness_n_m = motion.stiffness_n_m;
    gains.rotational_stiffness_nm_rad = motion.rotational_stiffness_nm_rad;
    const Pose& goal = motion.world_T_tool.back();
    memory_.set_point.reset();
    memory_.held_orientation = goal.linear();

    MotionResult result;
    const double start_s = world_.time_s();
    const double path_before_m = memory_.statistics.path_length_m;
    double resting_s = 0.0;
    for (;;) {
      const double t = world_.time_s() - start_s;
      if (t >= motion.time_limit_s || world_.time_s() >= memory_.deadline_s) {
        result.reason = StopReason::kTimeLimit;
        result.detail =
            t >= motion.time_limit_s ? "the time limit of the motion is over" : "the time of the episode is over";
        break;
      }
      StepOnce(CartesianImpedance(world_, frame_, world_.qd_rad_s(), trajectory.At(t), gains));
      if (memory_.sensor.filtered().force_n.norm() > motion.force_limit_n ||
          memory_.sensor.ArmForce() > options_.protective_force_n) {
        const bool arm = memory_.sensor.ArmForce() > options_.protective_force_n;
        result.reason = arm ? StopReason::kAborted : StopReason::kForceLimit;
        if (arm) result.detail = ProtectiveStop();
        result.contact = true;
        break;
      }
      if (Interrupted(result)) return result;
      if (t >= trajectory.duration_s()) {
        const Vector6 twist = frame_.jacobian * world_.qd_rad_s();
        resting_s = twist.head<3>().norm() < options_.settle_speed_m_s ? resting_s + world_.timestep_s() : 0.0;
        if (resting_s >= motion.rest_time_s) {
          const bool there = (ToolPose().translation() - goal.translation()).norm() <= options_.compliant_reach_m;
          result.reason = there ? StopReason::kReached : StopReason::kContact;
          result.contact = memory_.sensor.ToolFlag();
          break;
        }
      }
    }
    result.world_T_tool = ToolPose();
    const Eigen::Vector3d way = goal.translation() - start.translation();
    result.travelled_m = way_points.size() == 2 && way.norm() > 1e-9
                             ? (result.world_T_tool.translation() - start.translation()).dot(way.normalized())
                             : memory_.statistics.path_length_m - path_before_m;
    if (result.reason == StopReason::kReached || result.reason == StopReason::kContact) {
      memory_.compliant_end = TwistReference{world_.time_s(), goal, Vector6::Zero()};
    }
    if (result.reason == StopReason::kForceLimit || result.reason == StopReason::kAborted) Hold(result);
    return result;
  });
}

}  // namespace feeler::env
