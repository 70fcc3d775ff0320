// Motions with a given velocity: an integrated twist, tracked in joint space.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "feeler/core/error.h"
#include "feeler/env/robot/motion_arguments.h"
#include "feeler/env/robot/simulated_robot.h"

namespace feeler::env {

std::optional<JointReference> SimulatedRobot::Advance(const Vector6& wanted, TwistReference& reference,
                                                      JointVector& q) const {
  const double dt = world_.timestep_s();
  // The velocity changes as fast as the robot's acceleration allows, linear and angular each along a straight line.
  const auto approach = [&](Eigen::Index part, double acceleration) {
    const Eigen::Vector3d change = wanted.segment<3>(part) - reference.twist.segment<3>(part);
    const double most = acceleration * dt;
    reference.twist.segment<3>(part) +=
        change.norm() > most ? Eigen::Vector3d(change * (most / change.norm())) : change;
  };
  approach(0, options_.acceleration_m_s2);
  approach(3, options_.angular_acceleration_rad_s2);
  const Eigen::PartialPivLU<Matrix6> jacobian(ToolJacobian(*scene_, q));
  JointVector speed = jacobian.solve(reference.twist);
  if (!speed.allFinite()) return std::nullopt;
  const double excess = speed.cwiseAbs().cwiseQuotient(scene_->velocity_limit_rad_s).maxCoeff();
  if (excess > 1.0) {
    reference.twist /= excess;
    speed /= excess;
  }
  Pose next = reference.world_T_tool;
  next.translation() += dt * reference.twist.head<3>();
  const double turn = dt * reference.twist.tail<3>().norm();
  if (turn > 0.0) next.linear() = Eigen::AngleAxisd(turn, reference.twist.tail<3>().normalized()) * next.linear();
  JointVector there = q;
  if (!SolveNearby(*scene_, next, there)) return std::nullopt;
  const mjModel& model = *scene_->model;
  for (int i = 0; i < kJointCount; ++i) {
    const int joint = scene_->joint[static_cast<std::size_t>(i)];
    const mjtNum* range = model.jnt_range + 2 * joint;
    if (model.jnt_limited[joint] != 0 && (there[i] < range[0] || there[i] > range[1])) return std::nullopt;
  }
  reference.world_T_tool = next;
  q = there;
  JointReference result;
  result.q_rad = q;
  result.qd_rad_s = speed;
  return result;
}

MotionResult SimulatedRobot::FollowTwist(const TwistMotion& motion) {
  RequirePose(motion.tool_T_frame, "twist");
  if (!motion.linear_m_s.allFinite() || !motion.angular_rad_s.allFinite()) {
    throw InputError("twist", "the velocity is not finite", "give finite numbers");
  }
  RequirePositive(motion.duration_s, "twist", "the duration (s)");
  RequirePositive(motion.contact_force_n, "twist", "the contact force (N)");
  return Guard([&] {
    MotionResult result;
    const Pose start = ToolPose();
    const bool goes_on = memory_.twist_reference && memory_.twist_reference->time_s == world_.time_s();
    TwistReference reference =
        goes_on ? *memory_.twist_reference : TwistReference{world_.time_s(), ArmPose(), Vector6::Zero()};
    memory_.set_point.reset();
    JointVector q = q_rad();
    bool released = memory_.sensor.raw().force_n.norm() <= motion.contact_force_n;
    Watch watch;
    watch.tool_force_n = motion.contact_force_n;
    const auto steps = std::max(1L, std::lround(motion.duration_s / world_.timestep_s()));
    for (long step = 0; step < steps; ++step) {
      if (world_.time_s() >= memory_.deadline_s) {
        result.reason = StopReason::kTimeLimit;
        result.detail = "the time of the episode is over";
        break;
      }
      // The frame turns with the tool, and so does the velocity that it is to have.
      const Eigen::Matrix3d world_R_tool = reference.world_T_tool.linear();
      const Eigen::Matrix3d world_R_frame = world_R_tool * motion.tool_T_frame.linear();
      Vector6 wanted;
      wanted.tail<3>() = world_R_frame * motion.angular_rad_s;
      const Eigen::Vector3d lever = world_R_tool * motion.tool_T_frame.translation();
      wanted.head<3>() = world_R_frame * motion.linear_m_s - wanted.tail<3>().cross(lever);
      const auto joints = Advance(wanted, reference, q);
      if (!joints) {
        result.reason = StopReason::kUnplanned;
        result.detail = "the twist leaves the reach or the joint limits of the arm";
        break;
      }
      watch.direction = reference.twist.head<3>().normalized();
      TrackStep(*joints);
      if (IsContact(watch, released)) {
        result.contact = true;
        result.world_T_tool = memory_.tool_at_sensing;
        const bool arm = memory_.sensor.ArmForce() > options_.protective_force_n;
        result.reason = arm ? StopReason::kAborted : StopReason::kContact;
        if (arm) result.detail = ProtectiveStop();
        break;
      }
      if (Interrupted(result)) return result;
    }
    if (result.reason == StopReason::kReached) {
      reference.time_s = world_.time_s();
      memory_.twist_reference = reference;
    } else {
      Hold(result);
    }
    memory_.held_orientation = reference.world_T_tool.linear();
    if (!result.contact) result.world_T_tool = ToolPose();
    result.travelled_m = (result.world_T_tool.translation() - start.translation()).norm();
    return result;
  });
}

}  // namespace feeler::env
