// Laws of a target on springs: pushed, it gives way by the force over the stiffness, within the friction that may hold
// it, and by no more than its travel; left alone it comes back to within friction over stiffness; it stands fast where
// no stiffness is given; a saved state goes on bit for bit; stiffnesses that make no sense are refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "feeler/core/error.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

class CompliantPort : public ::testing::Test {
 protected:
  void Place(double stiffness_n_m) {
    PhysicsVariation variation;
    variation.port_stiffness_n_m = stiffness_n_m;
    robot_.Reset(At(*scene_, ToolAt(*scene_, {0.02, 0.02, 0.004})), scene_->task.world_T_target, NoisePreset("ideal"),
                 RandomStream(1, 0, "sensor"), variation);
  }
  MotionResult Press(double force_n, double time_s) {
    CompliantMotion motion;
    Pose below = robot_.ToolPose();
    below.translation() -= 0.02 * Eigen::Vector3d::UnitZ();
    motion.world_T_tool = {below};
    motion.speed_m_s = 0.01;
    motion.force_limit_n = force_n;
    motion.time_limit_s = time_s;
    return robot_.Compliant(motion);
  }
  double Given() const {
    return (scene_->task.world_T_target.translation() - robot_.world().TargetPose().translation()).z();
  }
  double PushNow() const { return robot_.ContactWrench().force_n.norm(); }

  std::shared_ptr<const Scene> scene_ = PlugScene();
  SimulatedRobot robot_{scene_};
};

TEST_F(CompliantPort, GivesWayByForceOverStiffness) {
  for (const double stiffness_n_m : {2e4, 5e4}) {
    Place(stiffness_n_m);
    double worst_n = 0.0;
    int pushed = 0;
    robot_.SetObserver(
        [&](const World& world) {
          double push_n = 0.0;
          for (const ContactForce& c : world.contacts()) push_n += std::abs(c.force_n.z());
          const double given_m = (scene_->task.world_T_target.translation() - world.TargetPose().translation()).z();
          if (push_n < 10.0) return;
          ++pushed;
          worst_n = std::max(worst_n, stiffness_n_m * given_m - push_n);
          EXPECT_LE(given_m, PhysicsVariation::kPortTravel_m + 1e-12);
        },
        0.001);
    Press(25.0, 3.0);
    EXPECT_GT(pushed, 20);
    EXPECT_GT(Given(), 0.1e-3) << "it gave way";
    EXPECT_LE(worst_n, 25.0) << "a spring that gives way holds no more than what pushed it";
    robot_.SetObserver({}, 0.0);
    Pose up = robot_.ToolPose();
    up.translation().z() += 0.01;
    robot_.LinearMove(up, 0.05, 1e6);
    EXPECT_NEAR(Given(), 0.0, PhysicsVariation::kPortFriction_n / stiffness_n_m + 1e-5);
    EXPECT_GT(Given(), 0.2 * PhysicsVariation::kPortFriction_n / stiffness_n_m) << "friction holds it";
  }
}

TEST_F(CompliantPort, StandsFastWithout) {
  Place(0.0);
  Press(25.0, 1.0);
  EXPECT_EQ(Given(), 0.0);
  Place(1e3);
  Press(60.0, 3.0);
  EXPECT_NEAR(Given(), PhysicsVariation::kPortTravel_m, 1e-6) << "soft springs end at the stop";
}

TEST_F(CompliantPort, ASavedStateGoesOn) {
  Place(2e4);
  Press(20.0, 0.8);
  const RobotState saved = robot_.Save();
  Press(30.0, 0.5);
  const double expected = Given();
  RobotState tampered = saved;
  tampered.world.port_home_m.x() = std::nan("");
  EXPECT_THROW(robot_.Restore(tampered), InputError);
  Place(0.0);
  robot_.Restore(saved);
  Press(30.0, 0.5);
  EXPECT_EQ(Given(), expected);
}

TEST_F(CompliantPort, RefusesWhatMakesNoSense) {
  for (const double stiffness_n_m : {-1.0, 10.0, 1e9, std::nan("")}) {
    EXPECT_THROW(Place(stiffness_n_m), InputError) << stiffness_n_m;
  }
}

}  // namespace
}  // namespace feeler::env
