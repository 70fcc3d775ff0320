#include "feeler/execution/remote/checked_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "feeler/execution/remote/robot_server.h"

namespace feeler::execution {
namespace {

/// A pose that the robot reports may lie so far outside of the box that it is led back in.
constexpr double kRounding_m = 1e-6;

/// Why no arm can be that stiff or turn that fast; empty: it may.
std::string AboveMost(const char* what, const char* unit, double asked, double most) {
  return asked <= most ? "" : fmt::format("a {} of {:g} {} is above {:g}", what, asked, unit, most);
}

std::string PlaceText(const Eigen::Vector3d& p) { return fmt::format("{:.3f} {:.3f} {:.3f} m", p.x(), p.y(), p.z()); }

}  // namespace

bool WorkspaceBox::Contains(const Eigen::Vector3d& place_m) const {
  return (place_m.array() >= min_m.array() - kRounding_m).all() &&
         (place_m.array() <= max_m.array() + kRounding_m).all();
}

std::string Describe(const PlannedMotion& motion, const Pose& world_T_tool) {
  const Eigen::Vector3d way = motion.world_T_end.translation() - world_T_tool.translation();
  int axis = 0;
  const double along_m = way.cwiseAbs().maxCoeff(&axis);
  std::string text(motion.kind);
  if (way.norm() > 0.0 && along_m > 0.999 * way.norm()) {
    text += fmt::format(" {}{}", way[axis] < 0.0 ? '-' : '+', "xyz"[axis]);
  }
  text += fmt::format(" {:.1f} mm", 1e3 * motion.length_m);
  if (motion.speed_m_s > 0.0) text += fmt::format(" at {:.0f} mm/s", 1e3 * motion.speed_m_s);
  if (motion.force_n > 0.0 && motion.force_n < kNotWatched_n) text += fmt::format(" until {:.1f} N", motion.force_n);
  return text + " to " + PlaceText(motion.world_T_end.translation());
}

std::string CheckedRobot::FaultOf(const PlannedMotion& motion, double watched_force_n, bool straight) const {
  const Capabilities& robot = limits_.robot;
  const Pose here = robot_.ToolPose();
  if (!std::isfinite(motion.speed_m_s) || !std::isfinite(motion.force_n)) {
    return "a number of the motion is not finite";
  }
  if (straight && !limits_.box.Contains(here.translation())) {
    return "the tool stands outside of the workspace box, at " + PlaceText(here.translation());
  }
  std::vector<Pose> places = motion.via;
  places.push_back(motion.world_T_end);
  for (const Pose& pose : places) {
    if (!pose.matrix().allFinite()) return "a number of the motion is not finite";
    const Eigen::Vector3d& place = pose.translation();
    if (!limits_.box.Contains(place)) return PlaceText(place) + " is outside of the workspace box";
    if (!WorkspaceBox{robot.workspace_min_m, robot.workspace_max_m}.Contains(place)) {
      return PlaceText(place) + " is outside of what the robot states as its workspace";
    }
  }
  if (motion.speed_m_s > robot.max_speed_m_s * (1.0 + 1e-9)) {
    return fmt::format("{:.3f} m/s is above what the robot states, {:.3f} m/s", motion.speed_m_s, robot.max_speed_m_s);
  }
  if (watched_force_n > 0.0 && watched_force_n < kNotWatched_n && watched_force_n > limits_.force_budget_n) {
    return fmt::format("a contact force of {:.1f} N is above the force budget of {:.1f} N", watched_force_n,
                       limits_.force_budget_n);
  }
  if (motion.kind == "compliant" && motion.force_n > std::min(limits_.most_compliant_n, robot.max_force_n)) {
    return fmt::format("a force limit of {:.1f} N is above {:.1f} N", motion.force_n,
                       std::min(limits_.most_compliant_n, robot.max_force_n));
  }
  return limits_.way_fault ? limits_.way_fault({here, std::move(places), motion.speed_m_s, straight}) : "";
}

std::optional<MotionResult> CheckedRobot::Check(const PlannedMotion& motion, double watched_force_n, bool straight) {
  if (refusal_.empty()) refusal_ = FaultOf(motion, watched_force_n, straight);
  if (refusal_.empty() && ask_) refusal_ = ask_(motion);
  if (refusal_.empty()) return std::nullopt;
  MotionResult result;
  result.reason = StopReason::kUnplanned;
  result.detail = "refused before it was sent: " + refusal_;
  result.world_T_tool = robot_.ToolPose();
  return result;
}

MotionResult CheckedRobot::Transfer(const Pose& world_T_tool) {
  const double length_m = (world_T_tool.translation() - ToolPose().translation()).norm();
  if (const auto refused = Check({"transfer", world_T_tool, length_m, 0.0, 0.0, {}}, 0.0, false)) return *refused;
  return robot_.Transfer(world_T_tool);
}

MotionResult CheckedRobot::LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) {
  const double length_m = (world_T_tool.translation() - ToolPose().translation()).norm();
  const double speed = limits_.speed_scale * speed_m_s;
  if (const auto refused =
          Check({"linear", world_T_tool, length_m, speed, contact_force_n, {}}, contact_force_n, true)) {
    return *refused;
  }
  return robot_.LinearMove(world_T_tool, speed, contact_force_n);
}

MotionResult CheckedRobot::Guarded(const GuardedMotion& motion) {
  GuardedMotion scaled = motion;
  scaled.speed_m_s *= limits_.speed_scale;
  Pose end = ToolPose();
  end.translation() += motion.distance_m * motion.direction;
  const PlannedMotion planned{"guarded", end, motion.distance_m, scaled.speed_m_s, motion.contact_force_n, {}};
  if (const auto refused = Check(planned, motion.contact_force_n, true)) return *refused;
  return robot_.Guarded(scaled);
}

MotionResult CheckedRobot::Compliant(const CompliantMotion& motion) {
  CompliantMotion scaled = motion;
  scaled.speed_m_s *= limits_.speed_scale;
  // Pressing for longer does no harm: what takes longer at a lower speed is given the time.
  scaled.time_limit_s /= limits_.speed_scale;
  Eigen::Vector3d before = ToolPose().translation();
  double length_m = 0.0;
  for (const Pose& pose : motion.world_T_tool) {
    length_m += (pose.translation() - before).norm();
    before = pose.translation();
  }
  PlannedMotion planned{"compliant",      Pose::Identity(),     length_m,
                        scaled.speed_m_s, motion.force_limit_n, motion.world_T_tool};
  if (refusal_.empty()) {
    refusal_ = AboveMost("stiffness", "N/m", motion.stiffness_n_m.maxCoeff(), kMostStiffness_n_m) +
               AboveMost("rotational stiffness", "Nm/rad", motion.rotational_stiffness_nm_rad,
                         kMostRotationalStiffness_nm_rad);
  }
  if (planned.via.empty() && refusal_.empty()) return robot_.Compliant(scaled);  // which says what it thinks of no way
  if (!planned.via.empty()) {
    planned.world_T_end = planned.via.back();
    planned.via.pop_back();
  }
  if (const auto refused = Check(planned, 0.0, true)) return *refused;
  return robot_.Compliant(scaled);
}

MotionResult CheckedRobot::FollowTwist(const TwistMotion& motion) {
  TwistMotion scaled = motion;
  scaled.linear_m_s *= limits_.speed_scale;
  scaled.angular_rad_s *= limits_.speed_scale;
  Pose end = ToolPose();
  end.translation() += motion.duration_s * (end.linear() * motion.tool_T_frame.linear() * scaled.linear_m_s);
  const double speed_m_s = scaled.linear_m_s.norm();
  if (refusal_.empty()) {
    refusal_ = AboveMost("turning rate", "rad/s", scaled.angular_rad_s.norm(), kMostRate_rad_s);
  }
  const PlannedMotion planned{"twist", end, motion.duration_s * speed_m_s, speed_m_s, motion.contact_force_n, {}};
  if (const auto refused = Check(planned, motion.contact_force_n, true)) return *refused;
  return robot_.FollowTwist(scaled);
}

}  // namespace feeler::execution
