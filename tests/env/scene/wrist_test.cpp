// Laws of a wrist that gives way. Without one the scene is the text that it was. With one: the springs carry the
// weight, so that a tool at rest does not sag; pushed with F it gives way by F/k, along any axis, and by no more than
// its travel; the robot knows where the tool is, so that a wall is felt where it stands, whatever the stiffness; the
// controllers see the arm that they would see with a tool held rigidly; a saved state goes on bit for bit; what makes
// no sense is refused, with what would.
#include "feeler/env/scene/wrist.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "feeler/core/error.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

constexpr double kStiffnesses_n_m[] = {2.1e3, 6.7e3, 1.83e4};

Scene WithWrist(double stiffness_n_m) {
  SceneOptions options;
  options.wrist_stiffness_n_m = stiffness_n_m;
  return BuildScene(LoadTask("plug"), options);
}

class WristTest : public ::testing::TestWithParam<double> {
 protected:
  void Place(const Eigen::Vector3d& displacement_m) {
    robot_.Reset(At(*scene_, ToolAt(*scene_, displacement_m)), scene_->task.world_T_target, NoisePreset("ideal"),
                 RandomStream(1, 0, "sensor"));
  }
  MotionResult Press(const Eigen::Vector3d& way_m, double time_s) {
    CompliantMotion motion;
    Pose beyond = robot_.ToolPose();
    beyond.translation() += scene_->task.world_T_target.linear() * way_m;
    motion.world_T_tool = {beyond};
    motion.speed_m_s = 0.02;
    motion.force_limit_n = 200.0;
    motion.time_limit_s = time_s;
    return robot_.Compliant(motion);
  }

  std::shared_ptr<const Scene> scene_ = std::make_shared<const Scene>(WithWrist(GetParam()));
  SimulatedRobot robot_{scene_};
};

TEST(Wrist, NoneChangesNothing) {
  const TaskModel plug = LoadTask("plug");
  const Scene plain = BuildScene(plug);
  const Scene rigid = WithWrist(0.0);
  EXPECT_EQ(rigid.xml, plain.xml);
  EXPECT_EQ(rigid.model->nv, kJointCount);
  EXPECT_EQ(plain.xml.find("wrist_x"), std::string::npos);
  const SimulatedRobot robot(std::make_shared<const Scene>(rigid));
  EXPECT_EQ(robot.world().WristDeflection(), Eigen::Vector3d::Zero());
}

TEST_P(WristTest, DoesNotSag) {
  Place({0.02, 0.01, 0.03});
  for (int i = 0; i < 20; ++i) {
    robot_.ZeroWrench();
    EXPECT_LT(robot_.world().WristDeflection().norm(), 1e-7);
  }
}

TEST_P(WristTest, GivesWayByForceOverStiffness) {
  // On the face beside the opening, and against a side of the housing.
  for (const auto& [start_m, way_m] : {std::pair{Eigen::Vector3d(0.02, 0.02, 0.003), Eigen::Vector3d(0, 0, -0.006)},
                                       {{-0.044, -0.01, -0.02}, {0.012, 0, 0}},
                                       {{0.01, 0.036, -0.01}, {0, -0.012, 0}}}) {
    Place(start_m);
    Press(way_m, 3.0);
    const Eigen::Vector3d force_n = robot_.world().ToolPose().linear().transpose() * robot_.sensor().exact().force_n;
    ASSERT_GT(force_n.norm(), 2.0);
    ASSERT_LT(force_n.norm(), 0.95 * GetParam() * Wrist::kTravel_m) << "not at the stops";
    EXPECT_LT((robot_.world().WristDeflection() - force_n / GetParam()).norm(), 0.02 * force_n.norm() / GetParam());
  }
}

TEST_P(WristTest, EndsAtItsStops) {
  Place({0.02, 0.02, 0.003});
  Press({0, 0, -0.036}, 4.0);
  const double force_n = robot_.sensor().exact().force_n.norm();
  EXPECT_GT(force_n, 80.0);
  EXPECT_NEAR(robot_.world().WristDeflection().norm(), Wrist::kTravel_m, 0.1 * Wrist::kTravel_m);
}

TEST_P(WristTest, FeelsAWallWhereItStands) {
  SimulatedRobot rigid(PlugScene());
  for (const double speed_m_s : {0.008, 0.037}) {
    GuardedMotion motion;
    motion.direction = -scene_->task.world_T_target.linear().col(2);
    motion.distance_m = 0.03;
    motion.speed_m_s = speed_m_s;
    const JointVector q = At(*scene_, ToolAt(*scene_, {0.02, 0.02, 0.0087}));
    rigid.Reset(q, scene_->task.world_T_target, NoisePreset("ideal"), RandomStream(1, 0, "sensor"));
    robot_.Reset(q, scene_->task.world_T_target, NoisePreset("ideal"), RandomStream(1, 0, "sensor"));
    const MotionResult expected = rigid.Guarded(motion);
    const MotionResult felt = robot_.Guarded(motion);
    EXPECT_TRUE(felt.contact);
    EXPECT_NEAR(felt.travelled_m, expected.travelled_m, 0.4e-3);
    EXPECT_GT(robot_.world().WristDeflection().norm(), 1e-4) << "held where it gave way";
    EXPECT_LT(PoseError(robot_.ToolPose(), robot_.world().ToolPose()).norm(), 1e-9);
  }
}

TEST_P(WristTest, TheArmIsTheOneThatHoldsRigidly) {
  const JointVector q = At(*scene_, ToolAt(*scene_, {0.02, 0.01, 0.02}));
  World rigid(PlugScene());
  World soft(scene_);
  rigid.Reset(q, scene_->task.world_T_target);
  soft.Reset(q, scene_->task.world_T_target);
  EXPECT_LT((soft.Inertia() - rigid.Inertia()).cwiseAbs().maxCoeff(), 1e-9);
  const JointVector v = JointVector::LinSpaced(-1.0, 2.0);
  EXPECT_LT((soft.InertiaTimes(v) - rigid.InertiaTimes(v)).norm(), 1e-9);
  EXPECT_LT((soft.BiasTorque() - rigid.BiasTorque()).norm(), 1e-9);
  EXPECT_NEAR(robot_.Contact(Eigen::Vector3d::UnitX()).held_mass_kg, scene_->model->body_mass[scene_->tool_body], 1e-3);
}

TEST_P(WristTest, IsDrawnAsItGivesWay) {
  Place({0.02, 0.02, 0.003});
  Press({0, 0, -0.006}, 1.0);
  const DataHandle drawn = MakeData(*scene_->drawn_model);
  CopyForDrawing(*scene_, robot_.world().data(), *drawn);
  EXPECT_LT(PoseError(ToolPose(*scene_, *drawn), robot_.world().ToolPose()).norm(), 1e-12);
}

TEST_P(WristTest, ASavedStateGoesOn) {
  Place({0.02, 0.02, 0.003});
  Press({0, 0, -0.006}, 0.4);
  const RobotState saved = robot_.Save();
  const MotionResult expected = Press({0, 0, -0.003}, 0.3);
  Place({0.0, 0.0, 0.05});
  robot_.Restore(saved);
  const MotionResult again = Press({0, 0, -0.003}, 0.3);
  EXPECT_EQ(again.world_T_tool.matrix(), expected.world_T_tool.matrix());
  EXPECT_EQ(again.peak_force_n, expected.peak_force_n);
}

INSTANTIATE_TEST_SUITE_P(Stiffnesses, WristTest, ::testing::ValuesIn(kStiffnesses_n_m));

TEST(Wrist, RefusesWhatMakesNoSense) {
  for (const double stiffness_n_m : {-1.0, 100.0, 1e7, std::nan("")}) {
    EXPECT_THROW(WithWrist(stiffness_n_m), InputError) << stiffness_n_m;
  }
  try {
    WithWrist(1e6);
    FAIL() << "the plug weighs 76 g";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("give at most 19000 N/m"));
  }
  EXPECT_NO_THROW(WithWrist(1.9e4));
}

}  // namespace
}  // namespace feeler::env
