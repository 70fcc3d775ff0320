// Laws of a spiral on a face without an opening: it presses with what is asked for, but no more than half of the force
// budget, goes across with half of the speed that the budget allows, and each of its motions begins where the one
// before was to end; it finds nothing.
#include "feeler/execution/contact/spiral_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "feeler/execution/contact/force_budget.h"

namespace feeler::execution {
namespace {

/// A tool over a face at height zero that gives way to nothing.
class FaceRobot final : public Robot {
 public:
  FaceRobot() { pose_.translation().z() = 0.01; }
  Pose ToolPose() const override { return pose_; }
  Wrench ContactWrench() const override { return {}; }
  void ZeroWrench() override {}
  double Time() const override { return time_s_; }
  MotionResult Transfer(const Pose& goal) override { return Go(goal); }
  MotionResult LinearMove(const Pose& goal, double /*speed_m_s*/, double /*force_n*/) override { return Go(goal); }
  MotionResult Guarded(const GuardedMotion& motion) override {
    Pose goal = pose_;
    goal.translation() += motion.distance_m * motion.direction;
    return Go(goal);
  }
  MotionResult Compliant(const CompliantMotion& motion) override {
    for (const Pose& pose : motion.world_T_tool) deepest_m = std::max(deepest_m, -pose.translation().z());
    fastest_m_s = std::max(fastest_m_s, motion.speed_m_s);
    stiffness_n_m = motion.stiffness_n_m.z();
    if (motion.world_T_tool.size() > 1) {
      EXPECT_LT((motion.world_T_tool.front().translation() - commanded_.translation()).norm(), 1e-9);
      ++going_on;
    }
    commanded_ = motion.world_T_tool.back();
    return Go(motion.world_T_tool.back());
  }

  double deepest_m = 0.0;
  double fastest_m_s = 0.0;
  double stiffness_n_m = 0.0;
  int going_on = 0;

 private:
  MotionResult Go(const Pose& goal) {
    pose_ = goal;
    time_s_ += 0.01;
    MotionResult result;
    result.contact = goal.translation().z() < 0.0;
    pose_.translation().z() = std::max(0.0, goal.translation().z());
    result.reason = result.contact ? StopReason::kContact : StopReason::kReached;
    result.world_T_tool = pose_;
    return result;
  }

  Pose pose_ = Pose::Identity();
  Pose commanded_ = Pose::Identity();
  double time_s_ = 0.0;
};

TEST(SpiralSearch, KeepsPressAndSpeedWithinTheBudget) {
  policies::SpiralSearch search;
  search.radius_m = 0.004;
  search.pitch_m = 0.001;
  search.speed_m_s = 0.08;
  search.press_n = 20.0;
  search.face_range_m = 0.005;
  for (const double budget_n : {10.0, 25.0, 1000.0, std::numeric_limits<double>::infinity()}) {
    FaceRobot robot;
    const LatticeFrame frame;
    ExecutorOptions options;
    options.force_budget_n = budget_n;
    ExecutionRecord record;
    Mover mover(robot, frame, Direction::kMinusZ, options, record, 0.0);
    EXPECT_FALSE(FindBySpiral(Task{}, Eigen::Vector3d::Zero(), search, mover));
    EXPECT_NEAR(robot.stiffness_n_m * robot.deepest_m, std::min(20.0, 0.5 * budget_n), 1e-6) << budget_n;
    EXPECT_NEAR(robot.fastest_m_s, std::min(0.08, 0.5 * SpeedWithinBudget(ContactResponse{}, budget_n)), 1e-9)
        << budget_n;
    EXPECT_GE(robot.going_on, 8) << budget_n;  // four turns
  }
}

}  // namespace
}  // namespace feeler::execution
