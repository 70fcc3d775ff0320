#pragma once

#include <memory>

#include "feeler/core/robot.h"
#include "feeler/planner/contact/travel_model.h"

namespace feeler::execution {

/// What a robot would answer if the target stood at a given pose: a point that moves and stops exactly where the
/// geometry is met. Nothing moves, no time passes but what the speeds say. For dry runs.
class DryRobot final : public Robot {
 public:
  DryRobot(std::unique_ptr<planner::TravelModel> world, const Pose& world_T_target, const Pose& world_T_tool);

  Pose ToolPose() const override { return world_T_tool_; }
  Wrench ContactWrench() const override { return {}; }
  void ZeroWrench() override {}
  double Time() const override { return time_s_; }
  MotionResult Transfer(const Pose& world_T_tool) override;
  MotionResult LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) override;
  MotionResult Guarded(const GuardedMotion& motion) override;
  MotionResult Compliant(const CompliantMotion& motion) override;

 private:
  double Room(Direction direction, const Eigen::Vector3d& offset_m = Eigen::Vector3d::Zero());
  bool Along(int axis, double distance_m);
  bool Straight(const Eigen::Vector3d& goal_m);
  bool GiveWay(Direction direction);
  MotionResult Report(bool arrived, const Eigen::Vector3d& from_m, double speed_m_s, double force_n);

  std::unique_ptr<planner::TravelModel> world_;
  Pose world_T_target_;
  Pose world_T_tool_;
  double time_s_ = 0.0;
};

}  // namespace feeler::execution
