#pragma once

#include <optional>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/planner/motion/serial_arm.h"

namespace feeler::execution {

/// A way of the tool as it is about to be sent.
struct PlannedWay {
  Pose from = Pose::Identity();
  std::vector<Pose> to;    ///< one after the other
  double speed_m_s = 0.0;  ///< 0: the robot's own
  bool straight = true;    ///< from pose to pose; else through joint space, as the robot likes
};

/// Says before a motion is sent whether the arm can make it: reach, limits and speeds of its joints, singularities.
///
/// How the tool sits behind the last joint is learned from where the robot stands and what it says of its tool, and
/// must stay so: otherwise the description is not of this arm or its base is another frame.
class ArmCheck {
 public:
  explicit ArmCheck(planner::SerialArm arm) : arm_(std::move(arm)) {}

  /// Why the way is none; empty: it can be made. `q_rad`: where the joints are now; empty: where the last way that was
  /// asked for left them, or somewhere on it (a dry run).
  std::string FaultOf(const std::vector<double>& q_rad, const PlannedWay& way);

 private:
  std::string TakeJoints(const std::vector<double>& q_rad, const Pose& from);
  std::string FaultOfStraight(const Pose& from, const Pose& to, double speed_m_s, Eigen::VectorXd& q) const;
  std::string FaultOfReach(const Pose& to, Eigen::VectorXd& q) const;
  /// Of a place on a way: limits, and joint speeds for the tool to move at `speed_m_s` in any direction.
  std::string FaultAt(const Eigen::VectorXd& q, double speed_m_s) const;

  planner::SerialArm arm_;
  std::optional<Pose> last_T_tool_;
  Eigen::VectorXd q_;  ///< as last known
};

}  // namespace feeler::execution
