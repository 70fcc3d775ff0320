// Laws of World: stepping it is mj_step, bit for bit; a reset erases the past, bit for bit; a saved state continues,
// bit for bit; contact forces belong to the tool pose they are said to belong to; broken physics is an error with a
// reason, and the world is as good as new after a reset.

#include "feeler/env/scene/world.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "feeler/core/error.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

// Falls gently onto the housing: gravity is carried, the tool pushed down.
JointVector PushDown(const World& world, double force_n) {
  Vector6 wrench = Vector6::Zero();
  wrench.z() = -force_n;
  return world.BiasTorque() + ToolJacobian(world.scene(), world.q_rad()).transpose() * wrench -
         world.InertiaTimes(20.0 * world.qd_rad_s());
}

std::vector<double> Trace(World& world, int steps) {
  std::vector<double> trace;
  for (int i = 0; i < steps; ++i) {
    world.Step(PushDown(world, 30.0));
    for (int j = 0; j < kJointCount; ++j) trace.push_back(world.q_rad()[j]);
    for (const ContactForce& c : world.contacts()) trace.push_back(c.force_n.z());
  }
  return trace;
}

class WorldTest : public ::testing::Test {
 protected:
  std::shared_ptr<const Scene> scene_ = PlugScene();
  JointVector start_ = At(*scene_, ToolAt(*scene_, {0.02, 0.02, 0.002}));
  Pose target_ = scene_->task.world_T_target;
};

TEST_F(WorldTest, SteppingIsMujocosStep) {
  World world(scene_);
  world.Reset(start_, target_);
  const DataHandle data = MakeData(*scene_->model);
  ResetScene(*scene_, start_, *data);
  SetTargetPose(*scene_, target_, *data);
  bool touched = false;
  for (int i = 0; i < 400; ++i) {
    world.Step(PushDown(world, 30.0));
    for (int j = 0; j < kJointCount; ++j) {
      data->ctrl[scene_->actuator[static_cast<std::size_t>(j)]] = world.applied_torque_nm()[j];
    }
    mj_step(scene_->model.get(), data.get());
    touched |= !world.contacts().empty();
    ASSERT_EQ(world.q_rad(), JointPositions(*scene_, *data)) << "step " << i;
    ASSERT_EQ(world.qd_rad_s(), JointVelocities(*scene_, *data)) << "step " << i;
  }
  EXPECT_TRUE(touched);
}

TEST_F(WorldTest, ResetErasesThePast) {
  World fresh(scene_);
  fresh.Reset(start_, target_);
  World used(scene_);
  used.Reset(scene_->home_q_rad, MakePose({0.7, 0.1, 0.2}, 0.3), {.joint_friction_nm = JointVector::Constant(2.0)});
  Trace(used, 50);
  used.Reset(start_, target_);
  EXPECT_EQ(Trace(fresh, 300), Trace(used, 300));
}

TEST_F(WorldTest, SavedStateContinues) {
  World world(scene_);
  world.Reset(start_, target_, {.joint_friction_nm = JointVector::Constant(0.5)});
  Trace(world, 150);
  const WorldState state = world.Save();
  const std::vector<double> continued = Trace(world, 150);
  Trace(world, 20);
  world.Restore(state);
  EXPECT_EQ(Trace(world, 150), continued);
  World other(scene_);
  other.Restore(state);
  EXPECT_EQ(Trace(other, 150), continued);

  WorldState foreign = state;
  foreign.qpos.pop_back();
  EXPECT_THROW(world.Restore(foreign), InputError);
}

TEST_F(WorldTest, ContactsBelongToTheToolPoseOfTheirMoment) {
  World world(scene_);
  world.Reset(At(*scene_, ToolAt(*scene_, {0.07, 0.02, kPanel_m + 0.002})), target_);
  int seen = 0, later = 0;
  for (int i = 0; i < 300; ++i) {
    world.Step(PushDown(world, 30.0));
    // One geom of the tip against the panel's plane; a mesh, because between boxes MuJoCo reports half the depth.
    const int corner = mj_name2id(&world.model(), mjOBJ_GEOM, "c13_corner_right");
    double deepest_m = 0.0;
    for (const ContactForce& c : world.contacts()) {
      if (c.geom1 == corner || c.geom2 == corner) deepest_m = std::min(deepest_m, c.distance_m);
    }
    if (deepest_m == 0.0) continue;
    ++seen;
    const auto lowest_m = [&](const Pose& tool) {
      double low = 1.0;
      for (const auto& [x, y] : {std::pair{7, 3}, {12, 3}, {7, 8}}) {
        low = std::min(low, (target_.inverse() * tool * Eigen::Vector3d(x * 1e-3, y * 1e-3, 0)).z() - kPanel_m);
      }
      return low;
    };
    ASSERT_NEAR(lowest_m(world.ToolPoseAtContact()), deepest_m, 1e-8) << "step " << i;
    later += std::abs(lowest_m(world.ToolPose()) - deepest_m) > 1e-6 ? 1 : 0;
  }
  EXPECT_GT(seen, 100);
  EXPECT_GT(later, 3);  // the present pose is another
}

TEST_F(WorldTest, ForceOnTheToolBalancesThePush) {
  World world(scene_);
  world.Reset(start_, target_);
  Trace(world, 1500);
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const ContactForce& c : world.contacts()) {
    const bool tool_second = scene_->geom_part[static_cast<std::size_t>(c.geom2)] == ScenePart::kTool;
    force += tool_second ? c.force_n : Eigen::Vector3d(-c.force_n);
  }
  EXPECT_NEAR(force.z(), 30.0, 0.3);
}

TEST_F(WorldTest, JointFrictionHoldsTheArm) {
  World world(scene_);
  world.Reset(start_, target_, {.joint_friction_nm = JointVector::Constant(3.0)});
  for (int i = 0; i < 200; ++i) world.Step(world.BiasTorque() + JointVector::Constant(2.5));
  const double held_rad = (world.q_rad() - start_).norm();
  world.Reset(start_, target_);
  for (int i = 0; i < 200; ++i) world.Step(world.BiasTorque() + JointVector::Constant(2.5));
  const double free_rad = (world.q_rad() - start_).norm();
  EXPECT_LT(held_rad, 0.05 * free_rad);  // not zero: MuJoCo's dry friction creeps
}

// After each of these the world must say why, refuse to go on, and run like new after a reset.
void ExpectFailureAndRecovery(World& world, const std::function<void()>& misuse, const std::string& reason,
                              const std::function<void()>& reset) {
  try {
    misuse();
    FAIL() << "no error; expected " << reason;
  } catch (const WorldError& error) {
    EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
  }
  EXPECT_FALSE(world.failure().empty());
  EXPECT_THROW(world.Step(JointVector::Zero()), WorldError);
  reset();
  EXPECT_TRUE(world.failure().empty());
  EXPECT_NO_THROW(world.Step(world.BiasTorque()));
  EXPECT_FALSE(std::filesystem::exists("MUJOCO_LOG.TXT"));
}

TEST_F(WorldTest, TorqueThatIsNotANumber) {
  World world(scene_);
  ExpectFailureAndRecovery(
      world, [&] { world.Step(JointVector::Constant(std::nan(""))); }, "not finite",
      [&] { world.Reset(start_, target_); });
  World fresh(scene_);
  fresh.Reset(start_, target_);
  world.Reset(start_, target_);
  EXPECT_EQ(Trace(world, 100), Trace(fresh, 100));
}

TEST_F(WorldTest, FullBuffers) {
  const TaskModel task = LoadTask("plug");
  for (const auto& [contacts, rows, reason] :
       {std::tuple{2, 300, "contact buffer full"}, std::tuple{100, 8, "constraint buffer full"}}) {
    SceneOptions options;
    options.max_contacts = contacts;
    options.max_constraints = rows;
    const auto tight = std::make_shared<const Scene>(BuildScene(task.task, task.xml, ModelsFolder().string(), options));
    World world(tight);
    world.Reset(start_, target_);
    ExpectFailureAndRecovery(
        world, [&] { Trace(world, 400); }, reason, [&] { world.Reset(tight->home_q_rad, target_); });
  }
}

TEST_F(WorldTest, UnstablePhysics) {
  World world(scene_);
  world.Reset(start_, target_);
  WorldState spinning = world.Save();
  for (double& speed : spinning.qvel) speed = 900.0;  // the arm's own Coriolis forces then tear it apart
  ExpectFailureAndRecovery(
      world,
      [&] {
        world.Restore(spinning);
        for (int i = 0; i < 100; ++i) world.Step(JointVector::Zero());
      },
      "unstable physics", [&] { world.Reset(start_, target_); });
}

TEST_F(WorldTest, BadResetIsRefused) {
  World world(scene_);
  EXPECT_THROW(world.Reset(JointVector::Constant(std::nan("")), target_), InputError);
  EXPECT_THROW(world.Reset(start_, target_, {.joint_friction_nm = JointVector::Constant(-1.0)}), InputError);
  Pose nowhere = target_;
  nowhere.translation().x() = std::nan("");
  EXPECT_THROW(world.Reset(start_, nowhere), InputError);
}

}  // namespace
}  // namespace feeler::env
