#include "feeler/execution/remote/arm_check.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "feeler/core/random.h"
#include "feeler/execution/records/pose_error.h"

namespace feeler::execution {
namespace {

/// An arm is calibrated to some millimetres of its description, and no tool is longer.
constexpr double kSamePlace_m = 0.005;
constexpr double kSameTurn_rad = 0.02;
constexpr double kLongestTool_m = 1.0;
/// Between two places of a straight way that are looked at.
constexpr double kWayStep_m = 0.005;
constexpr double kWayStep_rad = 0.02;
/// Joints that jump so far from one to the next have gone through a singularity.
constexpr double kJump_rad = 0.35;
/// A slow motion must be able to give way, too.
constexpr double kLeastSpeed_m_s = 0.02;
constexpr int kRestarts = 64;

Pose Between(const Pose& from, const Pose& to, double share) {
  const Eigen::Quaterniond a(from.linear());
  return MakePose(from.translation() + share * (to.translation() - from.translation()),
                  a.slerp(share, Eigen::Quaterniond(to.linear())));
}

std::string Place(const Pose& pose) {
  const Eigen::Vector3d p = pose.translation();
  return fmt::format("{:.3f} {:.3f} {:.3f} m", p.x(), p.y(), p.z());
}

}  // namespace

std::string ArmCheck::FaultOf(const std::vector<double>& q_rad, const PlannedWay& way) {
  if (std::string fault = TakeJoints(q_rad, way.from); !fault.empty()) return fault;
  Eigen::VectorXd q = q_;
  Pose from = way.from;
  for (const Pose& to : way.to) {
    std::string fault = way.straight ? FaultOfStraight(from, to, way.speed_m_s, q) : FaultOfReach(to, q);
    if (!fault.empty()) return fault;
    from = to;
  }
  q_ = q;
  return "";
}

std::string ArmCheck::TakeJoints(const std::vector<double>& q_rad, const Pose& from) {
  if (q_rad.empty()) {
    if (!last_T_tool_) return "the robot does not tell where its joints are";
    const auto near = arm_.SolveNearby(from, *last_T_tool_, q_);
    if (!near) return "no joint positions near the last ones put the tool where it stands, " + Place(from);
    q_ = *near;
    return "";
  }
  if (static_cast<int>(q_rad.size()) != arm_.joint_count()) {
    return fmt::format("the robot tells of {} joints, its description has {}", q_rad.size(), arm_.joint_count());
  }
  q_ = Eigen::Map<const Eigen::VectorXd>(q_rad.data(), static_cast<Eigen::Index>(q_rad.size()));
  const Pose last_T_tool = arm_.ForwardKinematics(q_).inverse() * from;
  if (!last_T_tool_) {
    if (last_T_tool.translation().norm() > kLongestTool_m) {
      return fmt::format(
          "the tool would be {:.2f} m behind the last joint: the description is not of this arm, or its base is "
          "another frame",
          last_T_tool.translation().norm());
    }
    last_T_tool_ = last_T_tool;
    return "";
  }
  const double off_m = (last_T_tool.translation() - last_T_tool_->translation()).norm();
  const double off_rad = AngleBetween(last_T_tool, *last_T_tool_);
  if (off_m > kSamePlace_m || off_rad > kSameTurn_rad) {
    return fmt::format(
        "joints and tool disagree with the description by {:.1f} mm and {:.1f} degrees: it is not of this arm, its "
        "base "
        "is another frame, or the tool has slipped",
        1e3 * off_m, off_rad * 180.0 / std::numbers::pi);
  }
  return "";
}

std::string ArmCheck::FaultOfStraight(const Pose& from, const Pose& to, double speed_m_s, Eigen::VectorXd& q) const {
  const double length_m = (to.translation() - from.translation()).norm();
  const double turn_rad = AngleBetween(from, to);
  const int steps = std::max(1, static_cast<int>(std::ceil(std::max(length_m / kWayStep_m, turn_rad / kWayStep_rad))));
  for (int i = 0; i <= steps; ++i) {
    const Pose pose = Between(from, to, static_cast<double>(i) / steps);
    const auto next = arm_.SolveNearby(pose, *last_T_tool_, q);
    std::string fault;
    if (!next) {
      fault = "no joint positions put the tool there: out of reach, or singular";
    } else if ((*next - q).cwiseAbs().maxCoeff() > kJump_rad) {
      fault = "the joints would have to jump: a singularity";
    } else {
      q = *next;
      fault = FaultAt(q, speed_m_s);
    }
    if (!fault.empty()) {
      return fmt::format("the arm cannot go straight: at {}, {:.1f} mm on the way, {}", Place(pose),
                         1e3 * length_m * i / steps, fault);
    }
  }
  return "";
}

std::string ArmCheck::FaultAt(const Eigen::VectorXd& q, double speed_m_s) const {
  for (int i = 0; i < arm_.joint_count(); ++i) {
    const auto& joint = arm_.joints()[i];
    if (q[i] < joint.lower_rad || q[i] > joint.upper_rad) {
      return fmt::format("{} would be at {:.2f} rad, outside of its limits of {:.2f} to {:.2f}", joint.name, q[i],
                         joint.lower_rad, joint.upper_rad);
    }
  }
  // A row of the inverse says how fast a joint turns for a tool that moves: its length, in the worst direction.
  const auto frame = arm_.FrameAt(q, *last_T_tool_);
  const Eigen::MatrixXd inverse = frame.jacobian.completeOrthogonalDecomposition().pseudoInverse();
  const double speed = std::max(speed_m_s, kLeastSpeed_m_s);
  for (int i = 0; i < arm_.joint_count(); ++i) {
    const auto& joint = arm_.joints()[i];
    const double needed = speed * inverse.block<1, 3>(i, 0).norm();
    if (!(needed <= joint.speed_rad_s)) {
      return fmt::format(
          "{} would need {:.1f} rad/s for a tool that moves at {:.0f} mm/s, and can {:.1f}: near a singularity",
          joint.name, needed, 1e3 * speed, joint.speed_rad_s);
    }
  }
  // At a singularity itself the pseudo-inverse leaves the direction that is lost out.
  const Eigen::VectorXd singular = Eigen::JacobiSVD<Eigen::MatrixXd>(frame.jacobian).singularValues();
  constexpr double kLost = 1e-4;
  if (singular.minCoeff() < kLost * singular.maxCoeff()) return "the arm is singular";
  return "";
}

std::string ArmCheck::FaultOfReach(const Pose& to, Eigen::VectorXd& q) const {
  RandomStream random(1, 0, "arm check");  // the same answer each time
  std::string fault = "no joint positions put the tool there: out of reach";
  for (int i = 0; i <= kRestarts; ++i) {
    Eigen::VectorXd start = q;
    for (int j = 0; i > 0 && j < arm_.joint_count(); ++j) {
      start[j] = random.Uniform(std::max(arm_.joints()[j].lower_rad, -std::numbers::pi),
                                std::min(arm_.joints()[j].upper_rad, std::numbers::pi));
    }
    auto found = arm_.SolveNearby(to, *last_T_tool_, start);
    if (!found) continue;
    for (int j = 0; j < arm_.joint_count(); ++j) {
      // The same place of the links, as near to zero as whole turns allow.
      if (std::isfinite(arm_.joints()[j].lower_rad)) (*found)[j] = std::remainder((*found)[j], 2.0 * std::numbers::pi);
    }
    const std::string there = FaultAt(*found, 0.0);
    if (there.empty()) {
      q = *found;
      return "";
    }
    fault = there;
  }
  return fmt::format("the arm cannot bring the tool to {}: {}", Place(to), fault);
}

}  // namespace feeler::execution
