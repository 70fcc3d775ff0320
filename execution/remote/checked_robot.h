#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/robot.h"
#include "feeler/execution/remote/arm_check.h"
#include "feeler/execution/remote/protocol/messages.h"

namespace feeler::execution {

/// A box that the tool reference may be in, base frame.
struct WorkspaceBox {
  Eigen::Vector3d min_m = Eigen::Vector3d::Constant(-1e9);
  Eigen::Vector3d max_m = Eigen::Vector3d::Constant(1e9);
  bool Contains(const Eigen::Vector3d& place_m) const;
};

/// What every motion is checked against before it is sent (docs/safety.md).
struct SafetyLimits {
  WorkspaceBox box;          ///< of the cell
  Capabilities robot;        ///< what the robot states
  double speed_scale = 1.0;  ///< of all Cartesian speeds, 0 to 1
  /// No motion may ask for a contact force above this while it feels (guarded and watched motions); infinite: none.
  double force_budget_n = 1e9;
  double most_compliant_n = 1e9;  ///< nor for a larger force limit of a compliant motion
  /// Says why a way is none for the arm (ArmCheck: reach, joint limits, singularities); empty: the robot is trusted to.
  std::function<std::string(const PlannedWay&)> way_fault;
};

/// A motion as it is about to be sent.
struct PlannedMotion {
  std::string_view kind;  ///< transfer, linear, guarded, compliant, twist
  Pose world_T_end = Pose::Identity();
  double length_m = 0.0;
  double speed_m_s = 0.0;  ///< 0: the robot's own
  double force_n = 0.0;    ///< that ends it; 0: the robot's own
  std::vector<Pose> via;   ///< before the end
};
/// For people: "guarded -z 12.0 mm at 50 mm/s until 5 N".
std::string Describe(const PlannedMotion& motion, const Pose& world_T_tool);

/// Stands before a robot and lets through what is within the limits. A motion that is not is not sent: it ends with
/// kUnplanned, the robot stays at rest, and so it does for every later motion. The executor ends with the reason.
class CheckedRobot final : public Robot {
 public:
  /// Both outlive it.
  CheckedRobot(Robot& robot, SafetyLimits limits) : robot_(robot), limits_(std::move(limits)) {}

  /// Asked before each motion that passed; a text refuses it (an operator who says no). Empty: nobody is asked.
  void SetAsk(std::function<std::string(const PlannedMotion&)> ask) { ask_ = std::move(ask); }

  Pose ToolPose() const override { return robot_.ToolPose(); }
  Wrench ContactWrench() const override { return robot_.ContactWrench(); }
  double Time() const override { return robot_.Time(); }
  std::vector<double> JointPositions() const override { return robot_.JointPositions(); }
  void ZeroWrench() override { robot_.ZeroWrench(); }
  CameraView Look() override { return robot_.Look(); }
  ContactResponse Contact(const Eigen::Vector3d& direction) const override { return robot_.Contact(direction); }
  MotionResult Transfer(const Pose& world_T_tool) override;
  MotionResult LinearMove(const Pose& world_T_tool, double speed_m_s, double contact_force_n) override;
  MotionResult Guarded(const GuardedMotion& motion) override;
  MotionResult Compliant(const CompliantMotion& motion) override;
  MotionResult FollowTwist(const TwistMotion& motion) override;

  /// Why a motion was refused; empty while none was.
  const std::string& refusal() const { return refusal_; }

 private:
  /// Empty: let it through.
  std::optional<MotionResult> Check(const PlannedMotion& motion, double watched_force_n, bool straight);
  std::string FaultOf(const PlannedMotion& motion, double watched_force_n, bool straight) const;

  Robot& robot_;
  SafetyLimits limits_;
  std::function<std::string(const PlannedMotion&)> ask_;
  std::string refusal_;
};

}  // namespace feeler::execution
