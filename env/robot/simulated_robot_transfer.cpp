// Motions through joint space around obstacles.
#include <algorithm>

#include "feeler/core/error.h"
#include "feeler/env/robot/motion_arguments.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/planner/motion/time_parametrization.h"

namespace feeler::env {

std::vector<Eigen::VectorXd> SimulatedRobot::PlanWay(const Pose& world_T_tool, std::string& reason, bool& interrupted) {
  const JointVector start = q_rad();
  if (options_.transfer_planner) {
    const std::vector<JointVector> way = options_.transfer_planner(world_, start, world_T_tool);
    if (way.empty()) reason = "no collision-free way was found";
    return {way.begin(), way.end()};
  }
  const Scene& scene = world_.scene();
  if (!transfer_checker_) transfer_checker_ = std::make_unique<TransferChecker>(scene, options_.transfer.clearance_m);
  transfer_checker_->SetTargetPoses(memory_.target_candidates);
  TransferSettings settings = options_.transfer;
  settings.seed = memory_.transfer_seed;
  int checks = 0;
  std::string why;
  settings.search.stop = [&] {
    constexpr int kChecksPerQuestion = 32;
    if (interruption_ && why.empty() && ++checks % kChecksPerQuestion == 0) why = interruption_();
    return !why.empty();
  };
  planner::TransferPlan plan = PlanTransfer(*transfer_checker_, scene, start, world_T_tool, settings);
  interrupted = !why.empty();
  reason = interrupted ? why : plan.reason;
  if (interrupted) plan.way_points.clear();
  return plan.way_points;
}

MotionResult SimulatedRobot::Transfer(const Pose& world_T_tool) {
  RequirePose(world_T_tool, "transfer");
  return Guard([&] {
    MotionResult result;
    const Scene& scene = world_.scene();
    bool interrupted = false;
    const std::vector<Eigen::VectorXd> way_points = PlanWay(world_T_tool, result.detail, interrupted);
    if (way_points.empty()) {
      result.reason = interrupted ? StopReason::kAborted : StopReason::kUnplanned;
      result.world_T_tool = ToolPose();
      return result;
    }
    planner::MotionLimits limits;
    limits.velocity_rad_s = transfer_speed_ * options_.joint_speed_fraction * scene.velocity_limit_rad_s;
    limits.acceleration_rad_s2 = JointVector::Constant(options_.joint_acceleration_rad_s2);
    planner::TimeParametrizationOptions timing;
    timing.reach_m = JointVector::Constant(1.5);  // no point of arm and tool is farther from a joint
    const planner::JointTrajectory trajectory = planner::Parametrize(way_points, limits, timing);
    memory_.set_point.reset();
    memory_.held_orientation = world_T_tool.linear();
    Watch watch;
    // Noise is no contact: what a guarded move needs to tell one from it, a transfer needs, too.
    watch.tool_force_n = std::max(options_.transfer_contact_force_n, memory_.noise.contact_threshold_n);
    watch.protective = true;
    const double path_before_m = memory_.statistics.path_length_m;
    const auto reference_at = [&](double t) -> std::optional<JointReference> {
      const planner::JointState state = trajectory.Sample(t);
      return JointReference{state.q_rad, state.qd_rad_s, state.qdd_rad_s2};
    };
    result = Follow(trajectory.duration_s(), reference_at, watch, true);
    result.travelled_m = memory_.statistics.path_length_m - path_before_m;
    return result;
  });
}

}  // namespace feeler::env
