// Kinematics of any serial arm from its URDF. Oracles: the published Denavit-Hartenberg values of the UR10e and its
// inverse in closed form; finite differences; a plane arm of seven joints whose poses are sums of sines. Laws: the pose
// that the joints give; a Jacobian is the derivative; what SolveNearby finds puts the frame there, and is found
// wherever a small step leads.

#include "feeler/planner/motion/serial_arm.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "feeler/core/data_folder.h"
#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/env/arm/ur10e.h"

namespace feeler::env {
namespace {

using planner::SerialArm;

SerialArm Ur10e(const std::string& base = "") {
  return SerialArm::FromUrdf((FindData("models") / "robots" / "ur10e.urdf").string(), base);
}

JointVector DrawnJoints(RandomStream& random) {
  JointVector q;
  for (double& angle : q) angle = random.Uniform(-3.0, 3.0);
  return q;
}

TEST(SerialArm, IsThePublishedUr10e) {
  const SerialArm arm = Ur10e();
  ASSERT_EQ(arm.joint_count(), kJointCount);
  const SerialArm from_inertia = Ur10e("base_link_inertia");  // turned by pi about z, behind a fixed joint
  RandomStream random(1, 0, "serial arm");
  Pose last_T_flange = Pose::Identity();
  for (int sample = 0; sample < 200; ++sample) {
    const JointVector q = DrawnJoints(random);
    const Pose last = arm.ForwardKinematics(q);
    // `tool0` is turned against wrist 3 by a fixed rotation: the same for every q.
    if (sample == 0) last_T_flange = last.inverse() * ForwardKinematics(q);
    EXPECT_LT(((last * last_T_flange).matrix() - ForwardKinematics(q).matrix()).cwiseAbs().maxCoeff(), 1e-9);
    const Pose turned = MakePose(Eigen::Vector3d::Zero(), std::numbers::pi) * from_inertia.ForwardKinematics(q);
    EXPECT_LT((turned.matrix() - last.matrix()).cwiseAbs().maxCoeff(), 1e-9);
  }
  EXPECT_LT(last_T_flange.translation().norm(), 1e-9);
}

TEST(SerialArm, JacobianIsTheDerivative) {
  const SerialArm arm = Ur10e();
  const Pose tool = MakePose(Eigen::Vector3d(0.02, -0.01, 0.2), 0.3);
  RandomStream random(2, 0, "serial arm");
  for (int sample = 0; sample < 50; ++sample) {
    const Eigen::VectorXd q = DrawnJoints(random);
    const auto frame = arm.FrameAt(q, tool);
    EXPECT_LT((frame.base_T_frame.matrix() - (arm.ForwardKinematics(q) * tool).matrix()).cwiseAbs().maxCoeff(), 1e-12);
    constexpr double kStep = 1e-6;
    for (int j = 0; j < arm.joint_count(); ++j) {
      const Eigen::VectorXd delta = kStep * Eigen::VectorXd::Unit(arm.joint_count(), j);
      const Pose before = arm.ForwardKinematics(q - delta) * tool;
      const Pose after = arm.ForwardKinematics(q + delta) * tool;
      const Eigen::Vector3d linear = (after.translation() - before.translation()) / (2 * kStep);
      const Eigen::AngleAxisd turn(Eigen::Matrix3d(after.linear() * before.linear().transpose()));
      EXPECT_LT((frame.jacobian.block<3, 1>(0, j) - linear).norm(), 1e-6);
      EXPECT_LT((frame.jacobian.block<3, 1>(3, j) - turn.angle() / (2 * kStep) * turn.axis()).norm(), 1e-6);
    }
  }
}

TEST(SerialArm, SolvesNearbyWhereTheClosedFormDoes) {
  const SerialArm arm = Ur10e();
  RandomStream random(3, 0, "serial arm");
  int solved = 0;
  int asked = 0;
  for (int sample = 0; sample < 300; ++sample) {
    const JointVector q = DrawnJoints(random);
    if (std::abs(std::sin(q[4])) < 0.2 || std::abs(std::sin(q[2])) < 0.2) continue;  // singular nearby
    JointVector near = q;
    for (double& angle : near) angle += random.Uniform(-0.1, 0.1);
    const Pose goal = arm.ForwardKinematics(near);
    ++asked;
    const auto found = arm.SolveNearby(goal, Pose::Identity(), q);
    if (!found) continue;
    ++solved;
    EXPECT_LT((arm.ForwardKinematics(*found).matrix() - goal.matrix()).cwiseAbs().maxCoeff(), 1e-6);
  }
  EXPECT_GT(asked, 150);
  EXPECT_GE(solved, asked - asked / 50);
  EXPECT_FALSE(arm.SolveNearby(MakePose({2.0, 0.0, 0.5}), Pose::Identity(), JointVector::Constant(0.5)));
}

std::string Written(const std::string& name, const std::string& text) {
  const std::string path = testing::TempDir() + "/" + name;
  std::ofstream(path) << text;
  return path;
}

TEST(SerialArm, SevenJointsInAPlane) {
  std::string text = "<robot name=\"plane\"><link name=\"l0\"/>";
  for (int i = 1; i <= 7; ++i) {
    const std::string n = std::to_string(i);
    text += "<link name=\"l" + n + "\"/><joint name=\"j" + n + "\" type=\"" + (i == 3 ? "continuous" : "revolute") +
            "\"><parent link=\"l" + std::to_string(i - 1) + "\"/><child link=\"l" + n + "\"/><origin xyz=\"" +
            (i == 1 ? "0" : "0.2") + " 0 0\"/><axis xyz=\"0 0 1\"/><limit lower=\"-2\" upper=\"2\" effort=\"1\" " +
            "velocity=\"1.5\"/></joint>";
  }
  // A gripper of two fingers that slide ends the chain.
  for (const std::string side : {"a", "b"}) {
    text += "<link name=\"f" + side + "\"/><joint name=\"s" + side + "\" type=\"prismatic\"><parent link=\"l7\"/>" +
            "<child link=\"f" + side + "\"/><axis xyz=\"1 0 0\"/><limit lower=\"0\" upper=\"1\" effort=\"1\" " +
            "velocity=\"1\"/></joint>";
  }
  const SerialArm arm = SerialArm::FromUrdf(Written("plane.urdf", text + "</robot>"));
  ASSERT_EQ(arm.joint_count(), 7);
  EXPECT_TRUE(std::isinf(arm.joints()[2].upper_rad));
  EXPECT_EQ(arm.joints()[6].speed_rad_s, 1.5);
  RandomStream random(4, 0, "serial arm");
  Eigen::VectorXd q(7);
  for (double& angle : q) angle = random.Uniform(-0.5, 0.5);
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  double heading = 0.0;
  for (int i = 0; i < 6; ++i) {
    heading += q[i];
    place += 0.2 * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.0);
  }
  EXPECT_LT((arm.ForwardKinematics(q).translation() - place).norm(), 1e-12);
}

TEST(SerialArm, WhatIsNoArmIsRefused) {
  const auto message = [](const std::string& text, const std::string& base = "") -> std::string {
    try {
      SerialArm::FromUrdf(Written("bad.urdf", text), base);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::string head = "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/>";
  const auto joint = [&](const std::string& inside) {
    return head + "<joint name=\"elbow\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/>" + inside +
           "</joint></robot>";
  };
  const std::string axis = "<axis xyz=\"0 0 1\"/>";
  EXPECT_NE(message("<robot").find("not a valid robot description"), std::string::npos);
  EXPECT_NE(message("<robot name=\"r\"><link name=\"a\"/></robot>").find("no turning joint"), std::string::npos);
  EXPECT_NE(message(joint(axis + "<limit lower=\"1\" upper=\"-1\" effort=\"1\" velocity=\"1\"/>")).find("elbow"),
            std::string::npos);
  EXPECT_NE(message(joint(axis + "<limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"0\"/>")).find("velocity"),
            std::string::npos);
  EXPECT_NE(
      message(joint(axis + "<limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>"), "hand").find("'hand'"),
      std::string::npos);
}

}  // namespace
}  // namespace feeler::env
