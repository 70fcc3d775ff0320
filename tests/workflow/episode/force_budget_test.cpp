// Laws of what a contact costs in force (SimulatedRobot::Contact): effective mass is that of a push along u with the
// rotation of the tool held; the world
// is as hard as it was: along z the plug is pushed with 2.15 N for every mm/s; and the speed that force_budget.h gives
// a budget keeps it, in every direction and at every budget, without being so careful that most of it stays unused.

#include "feeler/execution/contact/force_budget.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

struct Wall {
  Eigen::Vector3d start_m;
  Eigen::Vector3d direction;
};

class ContactResponseTest : public ::testing::Test {
 protected:
  std::shared_ptr<const Scene> scene_ = PlugScene();
  SimulatedRobot robot_{scene_};

  void Place(const Eigen::Vector3d& displacement_m) {
    NoiseOptions noise = NoisePreset("ideal");
    noise.force_delay_s = delay_s_;
    noise.joint_friction_nm = friction_ * NoisePreset("friction").joint_friction_nm;
    robot_.Reset(At(*scene_, ToolAt(*scene_, displacement_m)), scene_->task.world_T_target, noise,
                 RandomStream(1, 0, "sensor"));
  }
  double delay_s_ = 0.0;   ///< of the force sensor
  double friction_ = 0.0;  ///< of the joints, as a share of that of the preset
  Eigen::Vector3d InWorld(const Eigen::Vector3d& direction) const {
    return scene_->task.world_T_target.linear() * direction;
  }
  /// As the executor counts: faces lie across the insertion and hold the tool.
  ContactResponse Met(const Wall& wall) const {
    const ContactResponse told = robot_.Contact(InWorld(wall.direction));
    return wall.direction.z() < -0.9 ? told.Held() : told;
  }
  double PeakForce(const Wall& wall, double speed_m_s) {
    Place(wall.start_m);
    GuardedMotion motion;
    motion.direction = InWorld(wall.direction);
    motion.distance_m = 0.02;
    motion.speed_m_s = speed_m_s;
    const MotionResult result = robot_.Guarded(motion);
    EXPECT_TRUE(result.contact);
    EXPECT_DOUBLE_EQ(result.peak_force_n, robot_.statistics().peak_force_n);
    return result.peak_force_n;
  }
  const std::vector<Wall> walls_ = {
      {{0.02, 0.02, 0.0087}, -Eigen::Vector3d::UnitZ()},    {{-0.03, 0.003, 0.0061}, -Eigen::Vector3d::UnitZ()},
      {{-0.0573, -0.017, -0.02}, Eigen::Vector3d::UnitX()}, {{0.0541, 0, -0.008}, -Eigen::Vector3d::UnitX()},
      {{0.01, 0.0457, -0.01}, -Eigen::Vector3d::UnitY()},
  };
};

TEST_F(ContactResponseTest, EffectiveMassIsThatOfInertiaAndJacobian) {
  Place({0.01, 0.0, 0.02});
  const Eigen::Vector3d u = Eigen::Vector3d(0.3, -0.4, 0.6).normalized();
  const Matrix6 jacobian = ToolJacobian(*scene_, robot_.q_rad());
  // M a = J_t^T u f + C^T l with C a = 0: the acceleration along u of a force f, the rotation and both ways aside held.
  const Eigen::Vector3d aside = u.unitOrthogonal();
  Eigen::Matrix<double, 5, 6> constraint;
  constraint << jacobian.bottomRows<3>(), aside.transpose() * jacobian.topRows<3>(),
      u.cross(aside).transpose() * jacobian.topRows<3>();
  Eigen::Matrix<double, 11, 11> held = Eigen::Matrix<double, 11, 11>::Zero();
  held.topLeftCorner<6, 6>() = robot_.world().Inertia();
  held.topRightCorner<6, 5>() = -constraint.transpose();
  held.bottomLeftCorner<5, 6>() = constraint;
  Eigen::Matrix<double, 11, 1> force = Eigen::Matrix<double, 11, 1>::Zero();
  force.head<6>() = jacobian.topRows<3>().transpose() * u;
  const Eigen::Matrix<double, 11, 1> answer = held.fullPivLu().solve(force);
  EXPECT_NEAR(robot_.Contact(u).held_mass_kg * u.dot(jacobian.topRows<3>() * answer.head<6>()), 1.0, 1e-9);
}

TEST_F(ContactResponseTest, TheWorldIsAsHardAsItWas) {
  for (const double speed_m_s : {0.01, 0.025, 0.05}) {
    EXPECT_NEAR(PeakForce(walls_[0], speed_m_s) / (1e3 * speed_m_s), 2.15, 0.2) << speed_m_s;
  }
}

TEST_F(ContactResponseTest, TheSpeedOfABudgetKeepsIt) {
  for (const double budget_n : {10.0, 17.0, 25.0, 60.0}) {
    for (const Wall& wall : walls_) {
      Place(wall.start_m);
      const ContactResponse contact = Met(wall);
      const double speed_m_s = execution::SpeedWithinBudget(contact, budget_n);
      const double peak_n = PeakForce(wall, speed_m_s);
      EXPECT_LE(peak_n, budget_n) << wall.direction.transpose() << " at " << speed_m_s;
      EXPECT_GE(peak_n, 0.4 * budget_n) << wall.direction.transpose() << " at " << speed_m_s;
    }
  }
}

TEST_F(ContactResponseTest, AnEdgeThatIsBarelyMetKeepsTheBudget) {
  // The face of the target is at zero height: the tool overlaps its rim by this much.
  const std::vector<Wall> rims = {{{0.0, -0.0345, 0.0}, Eigen::Vector3d::UnitY()},
                                  {{0.01, 0.0345, 0.0}, -Eigen::Vector3d::UnitY()}};
  for (const double budget_n : {10.0, 25.0, 60.0}) {
    double worst_face_on_n = 0.0;
    for (Wall rim : rims) {
      for (const double overlap_m : {0.03e-3, 0.06e-3, 0.1e-3, 0.15e-3, 0.2e-3, 0.25e-3, 0.3e-3, 0.5e-3, 1e-3}) {
        rim.start_m.z() = -overlap_m;
        Place(rim.start_m);
        const ContactResponse face = robot_.Contact(InWorld(rim.direction));
        const ContactResponse beyond = robot_.Contact(InWorld(Eigen::Vector3d::UnitZ()));
        const double speed_m_s = execution::SpeedOverEdge(face, beyond, budget_n);
        EXPECT_LE(PeakForce(rim, speed_m_s), budget_n) << overlap_m << " at " << speed_m_s;
        worst_face_on_n = std::max(worst_face_on_n, PeakForce(rim, execution::SpeedWithinBudget(face, budget_n)));
      }
    }
    if (budget_n < 50.0) {
      EXPECT_GT(worst_face_on_n, budget_n) << "the speed for a face would not do";
    }
  }
}

TEST_F(ContactResponseTest, FrictionOfTheJointsIsCountedWith) {
  for (const double share : {0.2, 0.5, 1.0}) {
    friction_ = share;
    for (const Wall& wall : walls_) {
      Place(wall.start_m);
      EXPECT_EQ(robot_.Contact(InWorld(wall.direction)).push_n, 0.0) << "it has not moved";
      Pose back = robot_.ToolPose();
      const Pose start = back;
      back.translation() -= 0.01 * InWorld(wall.direction);
      robot_.LinearMove(back, 0.1, 10.0);
      robot_.LinearMove(start, 0.1, 10.0);
      const ContactResponse contact = Met(wall);
      EXPECT_GT(contact.push_n, 1.0);
      GuardedMotion motion;
      motion.direction = InWorld(wall.direction);
      motion.distance_m = 0.02;
      motion.speed_m_s = execution::SpeedWithinBudget(contact, 25.0);
      const MotionResult result = robot_.Guarded(motion);
      EXPECT_TRUE(result.contact);
      EXPECT_LE(result.peak_force_n, 25.0) << wall.direction.transpose() << ", " << share;
      EXPECT_GE(result.peak_force_n, 5.0);
    }
  }
}

TEST_F(ContactResponseTest, ALateSensorIsCountedWith) {
  for (const double delay_s : {0.003, 0.008}) {
    delay_s_ = delay_s;
    for (const Wall& wall : walls_) {
      Place(wall.start_m);
      const double speed_m_s = execution::SpeedWithinBudget(Met(wall), 25.0);
      const double peak_n = PeakForce(wall, speed_m_s);
      EXPECT_LE(peak_n, 25.0) << wall.direction.transpose() << " at " << speed_m_s << ", late by " << delay_s;
      EXPECT_GE(peak_n, 5.0);
    }
  }
}

}  // namespace
}  // namespace feeler::env
