#pragma once

#include <memory>
#include <string>

#include "feeler/core/robot.h"
#include "feeler/planner/contact/travel_model.h"

/// A robot of one's own, as small as one gets: a point that carries the tool, stops where the geometry of the task
/// stops it, and gives way sideways like a spring when it is pressed. A driver of a real arm implements the same
/// interface.
class SpringRobot final : public feeler::Robot {
 public:
  SpringRobot(std::unique_ptr<feeler::planner::TravelModel> world, const feeler::Pose& world_T_target,
              const feeler::Pose& world_T_tool);

  feeler::Pose ToolPose() const override { return world_T_tool_; }
  feeler::Wrench ContactWrench() const override { return {}; }
  void ZeroWrench() override {}
  double Time() const override { return time_s_; }
  feeler::MotionResult Transfer(const feeler::Pose& world_T_tool) override;
  feeler::MotionResult LinearMove(const feeler::Pose& world_T_tool, double speed_m_s, double contact_force_n) override;
  feeler::MotionResult Guarded(const feeler::GuardedMotion& motion) override;
  feeler::MotionResult Compliant(const feeler::CompliantMotion& motion) override;

 private:
  /// Metres to contact along an axis of the tool from a place displaced by `offset_m` in tool axes.
  double Room(feeler::Direction direction, const Eigen::Vector3d& offset_m = Eigen::Vector3d::Zero());
  /// Moves along an axis of the tool as far as there is room; false at a contact.
  bool Along(int axis, double distance_m);
  /// In a straight line to a place of the tool; false at a contact.
  bool Straight(const Eigen::Vector3d& goal_m);
  /// Steps aside to where the way along `direction` goes on; false if no place near has more room.
  bool GiveWay(feeler::Direction direction);
  feeler::MotionResult Report(bool arrived, const Eigen::Vector3d& from_m, double speed_m_s, double force_n);

  std::unique_ptr<feeler::planner::TravelModel> world_;
  feeler::Pose world_T_target_;
  feeler::Pose world_T_tool_;
  double time_s_ = 0.0;
};
