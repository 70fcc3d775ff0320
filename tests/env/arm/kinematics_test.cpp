// Laws of the closed-form kinematics of the UR10e:
//   FK(q) = base_T_flange;  FK(IK(T)[k]) = T to 1e-9 for every branch k;  q (wrapped) is among IK(FK(q));
//   no branch is listed twice, all joints lie in (-pi, pi];  IK(T) is empty iff T is out of reach;
//   Jacobian = derivative of FK (central differences as the oracle).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "feeler/core/random.h"
#include "feeler/env/arm/ur10e.h"

namespace feeler::env {
namespace {

constexpr double kPi = std::numbers::pi;

JointVector RandomJoints(RandomStream& random) {
  JointVector q;
  for (double& angle : q) angle = random.Uniform(-kPi, kPi);
  return q;
}

double Distance(const Pose& a, const Pose& b) {
  return std::max((a.translation() - b.translation()).norm(), (a.linear() - b.linear()).norm());
}

double JointDistance(const JointVector& a, const JointVector& b) {
  double largest = 0.0;
  for (int i = 0; i < kJointCount; ++i) largest = std::max(largest, std::abs(WrapAngle(a[i] - b[i])));
  return largest;
}

void ExpectBranches(const JointVector& q, double tolerance) {
  const Pose pose = ForwardKinematics(q);
  const std::vector<JointVector> branches = InverseKinematics(pose, q[5]);
  ASSERT_FALSE(branches.empty()) << q.transpose();
  ASSERT_LE(branches.size(), 8U);
  double nearest = 1e9;
  for (std::size_t i = 0; i < branches.size(); ++i) {
    EXPECT_LT(Distance(ForwardKinematics(branches[i]), pose), tolerance) << branches[i].transpose();
    EXPECT_LE(branches[i].maxCoeff(), kPi);
    EXPECT_GT(branches[i].minCoeff(), -kPi);
    nearest = std::min(nearest, JointDistance(branches[i], q));
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT(JointDistance(branches[i], branches[j]), 1e-9);
  }
  EXPECT_LT(nearest, 1e-6) << q.transpose();
}

TEST(Kinematics, ZeroConfigurationIsThePublishedOne) {
  // Outstretched: a2 and a3 along the arm, d5 down, d4 and d6 sideways.
  const Pose pose = ForwardKinematics(JointVector::Zero());
  const Eigen::Vector3d expected(0.6127 + 0.57155, 0.17415 + 0.11655, 0.1807 - 0.11985);
  EXPECT_LT((pose.translation() - expected).norm(), 1e-12) << pose.translation().transpose();
}

TEST(Kinematics, EveryBranchReachesThePoseAndTheSampleIsAmongThem) {
  RandomStream random(1, 0, "kinematics");
  double branches = 0.0;
  double worst = 0.0;
  constexpr int kSamples = 20000;
  for (int sample = 0; sample < kSamples; ++sample) {
    const JointVector q = RandomJoints(random);
    const Pose pose = ForwardKinematics(q);
    const std::vector<JointVector> solutions = InverseKinematics(pose);
    double nearest = 1e9;
    for (const JointVector& solution : solutions) {
      worst = std::max(worst, Distance(ForwardKinematics(solution), pose));
      nearest = std::min(nearest, JointDistance(solution, q));
    }
    ASSERT_LT(nearest, 1e-6) << q.transpose();
    branches += static_cast<double>(solutions.size());
  }
  EXPECT_LT(worst, 1e-9);
  RecordProperty("branches_mean", std::to_string(branches / kSamples));
  RecordProperty("worst_round_trip", std::to_string(worst * 1e15) + "e-15");
  EXPECT_GT(branches / kSamples, 6.0);
}

TEST(Kinematics, BranchesAreDistinctWrappedAndExact) {
  RandomStream random(2, 0, "kinematics");
  for (int sample = 0; sample < 500; ++sample) ExpectBranches(RandomJoints(random), 1e-9);
}

TEST(Kinematics, SingularConfigurations) {
  RandomStream random(3, 0, "kinematics");
  for (int sample = 0; sample < 200; ++sample) {
    for (const double wrist_2 : {0.0, kPi}) {  // wrist singularity: wrist 3 is given
      JointVector q = RandomJoints(random);
      q[4] = wrist_2;
      ExpectBranches(q, 1e-9);
    }
    for (const double elbow : {0.0, kPi}) {  // elbow straight or folded: two branches meet
      JointVector q = RandomJoints(random);
      q[2] = elbow;
      ExpectBranches(q, 1e-9);
    }
  }
}

TEST(Kinematics, OutOfReachHasNoSolution) {
  RandomStream random(4, 0, "kinematics");
  for (int sample = 0; sample < 200; ++sample) {
    const Eigen::Quaterniond orientation =
        Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal()).normalized();
    Eigen::Vector3d direction(random.Normal(), random.Normal(), random.Normal());
    const Pose far = MakePose(Eigen::Vector3d(1.6 * direction.normalized()), orientation);
    EXPECT_TRUE(InverseKinematics(far).empty());
    // The wrist on the axis of the shoulder pan, closer than d4.
    Pose inside = MakePose(Eigen::Vector3d(0.0, 0.0, 0.8), orientation);
    inside.translation() += Ur10eGeometry::kD6_m * inside.linear().col(2);
    EXPECT_TRUE(InverseKinematics(inside).empty());
  }
}

TEST(Kinematics, JacobianIsTheDerivative) {
  RandomStream random(5, 0, "kinematics");
  constexpr double kStep = 1e-6;
  for (int sample = 0; sample < 50; ++sample) {
    const JointVector q = RandomJoints(random);
    const Eigen::Matrix<double, 6, 6> jacobian = Jacobian(q);
    for (int i = 0; i < kJointCount; ++i) {
      JointVector up = q;
      JointVector down = q;
      up[i] += kStep;
      down[i] -= kStep;
      const Pose a = ForwardKinematics(up);
      const Pose b = ForwardKinematics(down);
      const Eigen::Vector3d linear = (a.translation() - b.translation()) / (2.0 * kStep);
      const Eigen::AngleAxisd turn(Eigen::Matrix3d(a.linear() * b.linear().transpose()));
      const Eigen::Vector3d angular = turn.axis() * turn.angle() / (2.0 * kStep);
      EXPECT_LT((jacobian.col(i).head<3>() - linear).norm(), 1e-8);
      EXPECT_LT((jacobian.col(i).tail<3>() - angular).norm(), 1e-8);
    }
  }
}

TEST(Kinematics, WrapsAngles) {
  EXPECT_EQ(WrapAngle(-kPi), kPi);
  EXPECT_EQ(WrapAngle(kPi), kPi);
  EXPECT_NEAR(WrapAngle(3.0 * kPi + 0.1), -kPi + 0.1, 1e-12);
}

}  // namespace
}  // namespace feeler::env
