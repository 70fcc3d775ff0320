#include "feeler/core/robot.h"

namespace feeler {

std::string_view ToString(StopReason reason) {
  switch (reason) {
    case StopReason::kReached: return "reached";
    case StopReason::kContact: return "contact";
    case StopReason::kForceLimit: return "force_limit";
    case StopReason::kTimeLimit: return "time_limit";
    case StopReason::kUnplanned: return "unplanned";
    case StopReason::kAborted: return "aborted";
  }
  return "";
}

ContactResponse Robot::Contact(const Eigen::Vector3d& /*direction*/) const { return {}; }

CameraView Robot::Look() { return {}; }

MotionResult Robot::FollowTwist(const TwistMotion& /*motion*/) {
  MotionResult result;
  result.reason = StopReason::kUnplanned;
  result.world_T_tool = ToolPose();
  result.detail = "this robot does not follow a twist";
  return result;
}

}  // namespace feeler
