// Laws of control. Trajectories: from rest to rest, velocity and acceleration are the derivatives of position, limits
// are kept. Kinematics: the Jacobian is the derivative of forward kinematics; SolveNearby inverts it and keeps its
// branch. Computed torque makes the commanded acceleration happen; impedance makes the tool feel as its spring says;
// the friction observer finds friction that the controller was not told.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "feeler/core/random.h"
#include "feeler/env/robot/impedance.h"
#include "feeler/env/robot/joint_control.h"
#include "feeler/env/robot/tool_kinematics.h"
#include "feeler/env/robot/trajectory.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

constexpr double kStep = 1e-6;

TEST(TrapezoidalProfile, DerivativesEndsAndLimits) {
  for (const auto& [distance, velocity, acceleration] :
       {std::tuple{0.1, 0.05, 1.0}, std::tuple{0.0005, 0.05, 1.0}, std::tuple{3.0, 0.5, 0.2}}) {
    const TrapezoidalProfile profile(distance, velocity, acceleration);
    EXPECT_EQ(profile.At(0).position, 0.0);
    EXPECT_EQ(profile.At(0).velocity, 0.0);
    EXPECT_EQ(profile.At(profile.duration_s()).position, distance);
    EXPECT_EQ(profile.At(profile.duration_s()).velocity, 0.0);
    for (int i = 1; i < 200; ++i) {
      const double t = profile.duration_s() * (i + 0.37) / 201;
      const ProfilePoint p = profile.At(t);
      EXPECT_NEAR((profile.At(t + kStep).position - profile.At(t - kStep).position) / (2 * kStep), p.velocity, 1e-5);
      EXPECT_LE(p.velocity, velocity * (1 + 1e-12));
      EXPECT_LE(std::abs(p.acceleration), acceleration);
    }
  }
}

TEST(TrapezoidalProfile, NoDistanceTakesNoTime) { EXPECT_EQ(TrapezoidalProfile(0.0, 1.0, 1.0).duration_s(), 0.0); }

Pose RandomPose(RandomStream& random, double angle_rad) {
  const Eigen::Vector3d axis(random.Normal(), random.Normal(), random.Normal());
  return MakePose({random.Uniform(-0.1, 0.1), random.Uniform(-0.1, 0.1), random.Uniform(-0.1, 0.1)},
                  Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis.normalized())));
}

TEST(PoseTrajectory, TwistIsTheDerivativeAndLimitsHold) {
  RandomStream random(3, 0, "pose-trajectory");
  CartesianLimits limits;
  for (int trial = 0; trial < 20; ++trial) {
    const Pose start = RandomPose(random, random.Uniform(0, 1));
    const Pose goal = trial % 4 == 0 ? start * MakePose({0.02, 0, 0.03}) : start * RandomPose(random, 0.5);
    PoseTrajectory trajectory({start, goal}, limits);
    if (trial % 2 == 0) trajectory = trajectory.Slowed(1.7);
    EXPECT_TRUE(trajectory.At(0).pose.isApprox(start, 1e-12));
    EXPECT_TRUE(trajectory.At(trajectory.duration_s()).pose.isApprox(goal, 1e-12));
    for (int i = 1; i < 50; ++i) {
      const double t = trajectory.duration_s() * (i + 0.37) / 51;
      const PosePoint p = trajectory.At(t);
      const Vector6 slope = PoseError(trajectory.At(t - kStep).pose, trajectory.At(t + kStep).pose) / (2 * kStep);
      EXPECT_LT((slope - p.twist).norm(), 1e-4);
      EXPECT_LE(p.twist.head<3>().norm(), limits.speed_m_s + 1e-9);
      EXPECT_LE(p.twist.tail<3>().norm(), limits.angular_speed_rad_s + 1e-9);
      EXPECT_LE(p.acceleration.head<3>().norm(), limits.acceleration_m_s2 + 1e-9);
      EXPECT_LE(p.acceleration.tail<3>().norm(), limits.angular_acceleration_rad_s2 + 1e-9);
    }
  }
}

TEST(PoseTrajectory, PassesItsWayPoints) {
  const std::vector<Pose> points = {MakePose({0, 0, 0}), MakePose({0.01, 0, 0}), MakePose({0.01, 0.02, 0})};
  const PoseTrajectory trajectory(points, {});
  double nearest_m = 1.0;
  for (double t = 0; t < trajectory.duration_s(); t += 1e-4) {
    nearest_m = std::min(nearest_m, (trajectory.At(t).pose.translation() - points[1].translation()).norm());
  }
  EXPECT_LT(nearest_m, 1e-5);
  EXPECT_NEAR(trajectory.duration_s(), 0.03 / 0.05 + 0.05, 1e-9);  // cruise, and a ramp's worth of start and stop
}

TEST(ToolKinematics, JacobianIsTheDerivative) {
  const auto scene = PlugScene();
  RandomStream random(5, 0, "jacobian");
  for (int trial = 0; trial < 30; ++trial) {
    JointVector q;
    for (int i = 0; i < kJointCount; ++i) q[i] = random.Uniform(-3, 3);
    const Matrix6 jacobian = ToolJacobian(*scene, q);
    for (int i = 0; i < kJointCount; ++i) {
      JointVector low = q, high = q;
      low[i] -= kStep;
      high[i] += kStep;
      const Vector6 slope =
          PoseError(ToolForwardKinematics(*scene, low), ToolForwardKinematics(*scene, high)) / (2 * kStep);
      EXPECT_LT((slope - jacobian.col(i)).norm(), 1e-8);
    }
  }
}

TEST(ToolKinematics, SolveNearbyFindsTheWayBackAndKeepsItsBranch) {
  const auto scene = PlugScene();
  RandomStream random(6, 0, "solve-nearby");
  for (int trial = 0; trial < 30; ++trial) {
    JointVector truth = scene->home_q_rad;
    for (int i = 0; i < kJointCount; ++i) truth[i] += random.Uniform(-0.1, 0.1);
    JointVector q = scene->home_q_rad;
    ASSERT_TRUE(SolveNearby(*scene, ToolForwardKinematics(*scene, truth), q));
    EXPECT_LT((q - truth).norm(), 1e-8);
  }
  JointVector q = scene->home_q_rad;
  EXPECT_FALSE(SolveNearby(*scene, MakePose({2.5, 0, 0.2}), q));
  EXPECT_EQ(q, scene->home_q_rad);
}

class ControlTest : public ::testing::Test {
 protected:
  std::shared_ptr<const Scene> scene_ = PlugScene();
  World world_{scene_};
  JointVector start_ = At(*scene_, ToolAt(*scene_, {0, 0, 0.05}));
  void SetUp() override { world_.Reset(start_, scene_->task.world_T_target); }
};

TEST_F(ControlTest, ComputedTorqueMakesTheCommandedAcceleration) {
  JointReference reference;
  reference.q_rad = start_;
  reference.qdd_rad_s2 = JointVector::LinSpaced(-1.0, 1.5);
  world_.Step(ComputedTorque(world_, world_.q_rad(), world_.qd_rad_s(), reference, {}));
  // The bias holds at the start of the step; viscous damping inside it is implicit, hence the tolerance.
  EXPECT_LT((world_.qd_rad_s() / world_.timestep_s() - reference.qdd_rad_s2).norm(), 0.02);
}

TEST_F(ControlTest, ImpedanceIsTheSpringItSaysInToolAxes) {
  ImpedanceGains gains;
  gains.stiffness_n_m = {700, 1300, 4100};
  PosePoint reference;
  reference.pose = world_.ToolPose();
  const Eigen::Vector3d stretch(0.001, -0.002, 0.0005);  // in tool axes
  reference.pose.translation() += reference.pose.linear() * stretch;
  const JointVector torque =
      CartesianImpedance(world_, ToolKinematics(*scene_, world_.q_rad()), world_.qd_rad_s(), reference, gains) -
      world_.BiasTorque();
  const Vector6 wrench = ToolJacobian(*scene_, start_).transpose().lu().solve(torque);
  const Eigen::Vector3d expected = world_.ToolPose().linear() * gains.stiffness_n_m.cwiseProduct(stretch);
  EXPECT_LT((wrench.head<3>() - expected).norm(), 1e-6);
  EXPECT_LT(wrench.tail<3>().norm(), 1e-6);
}

TEST_F(ControlTest, FrictionObserverFindsUnknownFriction) {
  const JointVector friction = Eigen::Map<const JointVector>(kRealisticJointFriction.data());
  world_.Reset(start_, scene_->task.world_T_target, {.joint_friction_nm = friction});
  FrictionObserver observer;
  JointReference reference;
  const JointVector speed = JointVector::Constant(0.1);
  for (int i = 0; i < 500; ++i) {
    reference.q_rad = start_ + speed * world_.time_s();
    reference.qd_rad_s = speed;
    observer.BeforeStep(world_.qd_rad_s(), world_.BiasTorque());
    world_.Step(ComputedTorque(world_, world_.q_rad(), world_.qd_rad_s(), reference, {}) - observer.estimate_nm());
    observer.AfterStep(world_, world_.qd_rad_s(), {}, ToolJacobian(*scene_, world_.q_rad()), i >= 250);
    if (i < 250) {
      EXPECT_TRUE(observer.most_nm().isZero(0.0)) << "something is touched";
    }
  }
  EXPECT_LT((observer.most_nm() - friction).norm(), 0.1) << observer.most_nm().transpose();
  EXPECT_LT((observer.estimate_nm() + friction).norm(), 0.1) << observer.estimate_nm().transpose();
  EXPECT_LT((world_.q_rad() - start_ - speed * world_.time_s()).norm(), 1e-5);
}

}  // namespace
}  // namespace feeler::env
