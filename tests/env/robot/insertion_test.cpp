// Laws of the insertion. The chamfer of 1 mm catches an error of 1 mm in x and y, with and without joint friction,
// and one of 2 mm in both fails; the verdict follows from the true poses alone: it is the same when the whole scene is
// moved, and each limit on its own turns it.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "feeler/env/gym/insertion_judge.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

InsertionVerdict Insert(SimulatedRobot& robot, const Eigen::Vector2d& error_m, const char* noise,
                        double yaw_rad = 0.0) {
  const Scene& scene = robot.world().scene();
  const Pose above = ToolAt(scene, {error_m.x(), error_m.y(), 0.005}) * MakePose({0, 0, 0}, yaw_rad);
  robot.Reset(At(scene, above), scene.task.world_T_target, NoisePreset(noise), RandomStream(1, 0, "sensor"));
  CompliantMotion motion;
  motion.world_T_tool = {above};
  motion.world_T_tool.front().translation().z() -= 0.005 + 0.019;
  robot.Compliant(motion);
  return JudgeInsertion(scene.task, LimitsOf(scene.task), robot.world().ToolPose(), robot.world().TargetPose(),
                        robot.statistics().peak_force_n, robot.Time());
}

class InsertionTest : public ::testing::TestWithParam<const char*> {};

TEST_P(InsertionTest, OneMillimetreSucceedsTwoFail) {
  SimulatedRobot robot(PlugScene());
  for (const double x : {-0.001, 0.0, 0.001}) {
    for (const double y : {-0.001, 0.0, 0.001}) {
      const InsertionVerdict verdict = Insert(robot, {x, y}, GetParam());
      EXPECT_TRUE(verdict.inserted) << x << " " << y << ": " << ToString(verdict.reason);
      EXPECT_LT(verdict.lateral_m, 0.00075);  // the clearance, to the corner
    }
  }
  for (const double x : {-0.002, 0.002}) {
    for (const double y : {-0.002, 0.002}) {
      const InsertionVerdict verdict = Insert(robot, {x, y}, GetParam());
      EXPECT_FALSE(verdict.inserted) << x << " " << y;
      EXPECT_LT(verdict.depth_m, 0.002);
    }
  }
}

TEST_P(InsertionTest, TwoDegreesOfYawAreFine) {
  SimulatedRobot robot(PlugScene());
  for (const double yaw_rad : {-0.0349, 0.0349}) EXPECT_TRUE(Insert(robot, {0, 0}, GetParam(), yaw_rad).inserted);
}

INSTANTIATE_TEST_SUITE_P(Noise, InsertionTest, ::testing::Values("ideal", "friction"),
                         [](const auto& test) { return test.param; });

TEST(InsertionJudge, EachLimitTurnsTheVerdict) {
  Task task;
  task.insertion = Direction::kMinusZ;
  task.insertion_depth_m = 0.018;
  InsertionLimits limits;
  const Pose target = MakePose({0.6, 0.1, 0.2}, 0.7);
  const auto judge = [&](const Eigen::Vector3d& displacement_m, double yaw_rad = 0.0, double force_n = 60,
                         double time_s = 5) {
    return JudgeInsertion(task, limits, target * MakePose(displacement_m, yaw_rad), target, force_n, time_s).reason;
  };
  EXPECT_EQ(judge({0, 0, -0.018}), InsertionReason::kInserted);
  EXPECT_EQ(judge({0.0009, 0.0009, -0.0171}), InsertionReason::kInserted);
  EXPECT_EQ(judge({0.0011, 0.0007, -0.0171}), InsertionReason::kOffToTheSide);
  EXPECT_EQ(judge({0, 0, -0.0169}), InsertionReason::kTooShallow);
  EXPECT_EQ(judge({0, 0, 0.018}), InsertionReason::kTooShallow);
  EXPECT_EQ(judge({0, 0, -0.018}, 0.11), InsertionReason::kTilted);
  EXPECT_EQ(judge({0, 0, -0.018}, 0, 251), InsertionReason::kTooMuchForce);
  EXPECT_EQ(judge({0, 0, -0.018}, 0, 60, 121), InsertionReason::kTooLate);
  EXPECT_EQ(judge({std::nan(""), 0, -0.018}), InsertionReason::kOffToTheSide);
}

TEST(InsertionJudge, DoesNotDependOnWhereTheSceneStands) {
  Task task;
  task.insertion = Direction::kPlusX;
  task.insertion_depth_m = 0.01;
  const Pose target = MakePose({0, 0, 0});
  const Pose tool = MakePose({0.0095, 0.0003, -0.0004}, 0.01);
  const InsertionVerdict here = JudgeInsertion(task, {}, tool, target, 0, 0);
  const Pose move =
      MakePose({0.3, -0.2, 0.5}, Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized())));
  const InsertionVerdict there = JudgeInsertion(task, {}, move * tool, move * target, 0, 0);
  EXPECT_TRUE(here.inserted);
  EXPECT_EQ(there.inserted, here.inserted);
  EXPECT_NEAR(there.depth_m, here.depth_m, 1e-12);
  EXPECT_NEAR(there.lateral_m, here.lateral_m, 1e-12);
  EXPECT_NEAR(there.angle_rad, here.angle_rad, 1e-7);
  EXPECT_NEAR(here.lateral_m, 0.0004, 1e-12);  // the larger of the two axes
}

}  // namespace
}  // namespace feeler::env
