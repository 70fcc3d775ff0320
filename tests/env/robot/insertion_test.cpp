// Laws of the insertion. The chamfer of 1 mm catches an error of 1 mm in x and y, with and without joint friction,
// and one of 2 mm in both fails; the verdict follows from the true poses alone: it is the same when the whole scene is
// moved, and each limit on its own turns it. Walls of the opening that hold the tool decide across the insertion,
// whatever the tolerance says; beside the opening nothing is inserted, however deep.

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
  return JudgeInsertion(scene.task, LimitsOf(scene), robot.world().ToolPose(), robot.world().TargetPose(),
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

TEST(InsertionJudge, WallsOfTheOpeningDecide) {
  const Scene& scene = *PlugScene();
  const double clearance_m = 0.0005;  // of the shipped socket, to each side
  for (const double tolerance_m : {1e-5, 0.001, 0.01}) {
    Task task = scene.task;
    task.tolerance.lateral_m = tolerance_m;
    Scene other = scene;
    other.task = task;
    const InsertionLimits limits = LimitsOf(other);
    for (const int axis : {0, 1}) {
      for (const double wall_m : limits.walls_m[static_cast<std::size_t>(axis)]) {
        EXPECT_GT(wall_m, clearance_m);
        EXPECT_LT(wall_m, clearance_m + 0.0002);
      }
    }
    const auto judge = [&](double x_m, double y_m) {
      const Pose tool = scene.task.world_T_target * MakePose({x_m, y_m, -scene.task.insertion_depth_m});
      return JudgeInsertion(task, limits, tool, scene.task.world_T_target, 0, 0).reason;
    };
    EXPECT_EQ(judge(clearance_m, -clearance_m), InsertionReason::kInserted) << tolerance_m;
    EXPECT_EQ(judge(0.0009, 0.0), InsertionReason::kOffToTheSide) << "in the wall";
    EXPECT_EQ(judge(0.0, -0.0009), InsertionReason::kOffToTheSide) << "in the wall";
    EXPECT_EQ(judge(0.045, 0.0), InsertionReason::kOffToTheSide) << "beside the housing";
    EXPECT_EQ(judge(0.0, 0.04), InsertionReason::kOffToTheSide) << "beside the housing";
  }
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
