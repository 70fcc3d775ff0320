// Law: a motion outside of the limits is not sent, nor is any later one, and the refusal says why.
#include "feeler/execution/remote/checked_robot.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "tests/execution/remote/point_robot.h"

namespace feeler::execution {
namespace {

TEST(WireChecks, AMotionOutsideOfTheLimitsIsNotSent) {
  const auto refusal = [](const std::function<void(SafetyLimits&)>& limit,
                          const std::function<MotionResult(Robot&)>& move) {
    PointRobot robot;
    SafetyLimits limits;
    limits.robot.max_speed_m_s = 0.5;
    limit(limits);
    CheckedRobot checked(robot, limits);
    const MotionResult result = move(checked);
    const bool still = robot.moved_steps == 0;
    EXPECT_EQ(result.reason == StopReason::kUnplanned, still);
    EXPECT_EQ(checked.Guarded(Down(0.001)).reason == StopReason::kUnplanned, still) << "it goes on after a refusal";
    return checked.refusal();
  };
  const auto none = [](SafetyLimits&) {};
  const auto down = [](Robot& robot) { return robot.Guarded(Down()); };
  EXPECT_EQ(refusal(none, down), "");
  EXPECT_NE(refusal([](SafetyLimits& l) { l.box.min_m.z() = 0.06; }, down).find("workspace box"), std::string::npos);
  EXPECT_NE(refusal([](SafetyLimits& l) { l.force_budget_n = 4.0; }, down).find("force budget"), std::string::npos);
  EXPECT_NE(refusal([](SafetyLimits& l) { l.robot.max_speed_m_s = 0.04; }, down).find("above what the robot states"),
            std::string::npos);
  EXPECT_EQ(refusal(
                [](SafetyLimits& l) {
                  l.robot.max_speed_m_s = 0.04;
                  l.speed_scale = 0.5;
                },
                down),
            "");
  EXPECT_NE(refusal([](SafetyLimits& l) { l.way_fault = [](const PlannedWay&) { return "singular"; }; }, down)
                .find("singular"),
            std::string::npos);
  const auto stiff = [](Robot& robot) {
    CompliantMotion motion;
    motion.world_T_tool = {robot.ToolPose()};
    motion.stiffness_n_m.x() = 1e12;
    return robot.Compliant(motion);
  };
  EXPECT_NE(refusal(none, stiff).find("stiffness of 1e+12"), std::string::npos);
  const auto through = [](Robot& robot) {
    CompliantMotion motion;
    motion.world_T_tool = {MakePose(Eigen::Vector3d(0.0, 0.5, 0.1)), MakePose(Eigen::Vector3d(0.0, 0.0, 0.09))};
    return robot.Compliant(motion);
  };
  EXPECT_NE(refusal([](SafetyLimits& l) { l.box.max_m.y() = 0.4; }, through).find("workspace box"), std::string::npos)
      << "a way point between the ends counts";
  EXPECT_NE(refusal([](SafetyLimits& l) { l.most_compliant_n = 50.0; }, through).find("force limit"),
            std::string::npos);
}

}  // namespace
}  // namespace feeler::execution
