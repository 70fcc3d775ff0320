#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "feeler/core/robot.h"
#include "feeler/execution/remote/robot_server.h"

namespace feeler::execution {

/// Straight down at 50 mm/s, watched.
inline GuardedMotion Down(double distance_m = 0.05) { return {-Eigen::Vector3d::UnitZ(), distance_m, 0.05, 5.0}; }

/// A point above a floor at z = 0, moved a millisecond at a time on its own clock; it asks whether to go on, as a
/// served robot must.
class PointRobot final : public Robot {
 public:
  Pose ToolPose() const override { return pose_; }
  Wrench ContactWrench() const override { return {}; }
  void ZeroWrench() override { ++zeroed; }
  double Time() const override { return time_s_; }
  MotionResult Transfer(const Pose& goal) override { return Go(goal, 0.25, false); }
  MotionResult LinearMove(const Pose& goal, double speed_m_s, double /*force*/) override {
    return Go(goal, speed_m_s, true);
  }
  MotionResult Guarded(const GuardedMotion& motion) override {
    Pose goal = pose_;
    goal.translation() += motion.distance_m * motion.direction;
    return Go(goal, motion.speed_m_s, true);
  }
  MotionResult Compliant(const CompliantMotion& motion) override {
    return Go(motion.world_T_tool.back(), motion.speed_m_s, true);
  }

  ServedRobot Served() {
    ServedRobot served{*this, "point", {}, {}, {}, {}, {}, {}};
    served.capabilities.motions = {"transfer", "linear", "guarded", "compliant"};
    served.capabilities.max_speed_m_s = 1.0;
    served.ask_while_moving = [this](std::function<std::string()> question) { question_ = std::move(question); };
    return served;
  }

  std::function<void()> each_step;  ///< seen while it moves
  int moved_steps = 0;
  int zeroed = 0;

 private:
  MotionResult Go(const Pose& goal, double speed_m_s, bool floor) {
    constexpr double kStep_s = 0.001;
    MotionResult result;
    const Eigen::Vector3d from = pose_.translation();
    const Eigen::Vector3d way = goal.translation() - from;
    const double length_m = way.norm();
    double done_m = 0.0;
    while (done_m < length_m) {
      done_m = std::min(length_m, done_m + kStep_s * speed_m_s);
      Eigen::Vector3d next = from + done_m / length_m * way;
      const bool touches = floor && next.z() < 0.0;
      if (touches) next.z() = 0.0;
      pose_.translation() = next;
      time_s_ += kStep_s;
      ++moved_steps;
      if (touches) {
        result.reason = StopReason::kContact;
        result.contact = true;
        result.peak_force_n = 6.0;
        break;
      }
      if (each_step) each_step();
      if (std::string why = question_ ? question_() : ""; !why.empty()) {
        result.reason = StopReason::kAborted;
        result.detail = why;
        break;
      }
    }
    result.world_T_tool = pose_;
    result.travelled_m = (pose_.translation() - from).norm();
    return result;
  }

  Pose pose_ = MakePose(Eigen::Vector3d(0.0, 0.0, 0.1));
  double time_s_ = 0.0;
  std::function<std::string()> question_;
};

}  // namespace feeler::execution
