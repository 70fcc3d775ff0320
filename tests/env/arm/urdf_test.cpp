// One robot, three descriptions: Denavit-Hartenberg, URDF, MJCF. Law: their forward kinematics agree to 1e-9 m for
// every joint configuration; masses, limits and torques of the URDF arrive in the compiled model unchanged.

#include <gtest/gtest.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/env/arm/ur10e.h"
#include "feeler/env/arm/urdf_to_mjcf.h"
#include "feeler/env/model/mujoco_handles.h"

namespace feeler::env {
namespace {

const std::string kUrdf = std::string(FEELER_SOURCE_DIR) + "/models/robots/ur10e.urdf";

std::string RobotAlone(const std::string& urdf, bool degrees = false) {
  tinyxml2::XMLDocument document;
  document.Parse("<mujoco/>");
  tinyxml2::XMLElement* compiler = document.RootElement()->InsertNewChildElement("compiler");
  compiler->SetAttribute("angle", degrees ? "degree" : "radian");
  UrdfToMjcfOptions options;
  options.angles_in_degrees = degrees;
  EmitRobot(urdf, options, *document.RootElement());
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

JointVector JointsWithinLimits(RandomStream& random) {
  JointVector q;
  for (double& angle : q) angle = random.Uniform(-2.0 * std::numbers::pi, 2.0 * std::numbers::pi);
  return q;
}

Pose FromUrdf(const urdf::Pose& pose) {
  const auto& r = pose.rotation;
  return MakePose(Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z),
                  Eigen::Quaterniond(r.w, r.x, r.y, r.z));
}

// Walks the chain from tool0 to the root as urdfdom gives it: an oracle that knows no MJCF.
Pose UrdfForwardKinematics(const urdf::ModelInterface& model, const JointVector& q) {
  Pose pose = Pose::Identity();
  for (urdf::LinkConstSharedPtr link = model.getLink("tool0"); link->parent_joint; link = link->getParent()) {
    Pose turn = Pose::Identity();
    for (int i = 0; i < kJointCount; ++i) {
      if (link->parent_joint->name == kJointNames[static_cast<std::size_t>(i)]) {
        const auto& axis = link->parent_joint->axis;
        turn.linear() = Eigen::AngleAxisd(q[i], Eigen::Vector3d(axis.x, axis.y, axis.z)).toRotationMatrix();
      }
    }
    pose = FromUrdf(link->parent_joint->parent_to_joint_origin_transform) * turn * pose;
  }
  return pose;
}

TEST(Urdf, ForwardKinematicsOfDhUrdfAndMjcfAgree) {
  const ModelHandle model = CompileMjcf(RobotAlone(kUrdf), "robot");
  const DataHandle data = MakeData(*model);
  const urdf::ModelInterfaceSharedPtr urdf_model = urdf::parseURDFFile(kUrdf);
  ASSERT_TRUE(urdf_model);
  const int flange = mj_name2id(model.get(), mjOBJ_BODY, "tool0");
  ASSERT_GE(flange, 0);
  RandomStream random(1, 0, "urdf");
  double worst = 0.0;
  for (int sample = 0; sample < 500; ++sample) {
    const JointVector q = JointsWithinLimits(random);
    for (int i = 0; i < kJointCount; ++i) {
      const int joint = mj_name2id(model.get(), mjOBJ_JOINT, kJointNames[static_cast<std::size_t>(i)]);
      data->qpos[model->jnt_qposadr[joint]] = q[i];
    }
    mj_kinematics(model.get(), data.get());
    const Pose dh = ForwardKinematics(q);
    for (const Pose& other : {BodyPose(*data, flange), UrdfForwardKinematics(*urdf_model, q)}) {
      worst = std::max(worst, (dh.translation() - other.translation()).norm());
      worst = std::max(worst, (dh.linear() - other.linear()).norm());
    }
  }
  EXPECT_LT(worst, 1e-9);
  RecordProperty("worst_disagreement_1e-15", std::to_string(worst * 1e15));
}

TEST(Urdf, InertiaLimitsAndTorquesArrive) {
  for (const bool degrees : {false, true}) {
    const ModelHandle model = CompileMjcf(RobotAlone(kUrdf, degrees), "robot");
    ASSERT_EQ(model->nv, 6);
    ASSERT_EQ(model->nu, 6);
    const double mass_kg[] = {7.369, 13.051, 3.989, 2.1, 1.98, 0.615};
    const double torque_nm[] = {330, 330, 150, 56, 56, 56};
    const double range_pi[] = {2, 2, 1, 2, 2, 2};
    const urdf::ModelInterfaceSharedPtr urdf_model = urdf::parseURDFFile(kUrdf);
    for (int i = 0; i < kJointCount; ++i) {
      const int joint = mj_name2id(model.get(), mjOBJ_JOINT, kJointNames[static_cast<std::size_t>(i)]);
      const int body = model->jnt_bodyid[joint];
      EXPECT_DOUBLE_EQ(model->body_mass[body], mass_kg[i]);
      EXPECT_DOUBLE_EQ(model->actuator_ctrlrange[2 * i + 1], torque_nm[i]);
      EXPECT_NEAR(model->jnt_range[2 * joint], -range_pi[i] * std::numbers::pi, 1e-12);
      EXPECT_NEAR(model->jnt_range[2 * joint + 1], range_pi[i] * std::numbers::pi, 1e-12);
      EXPECT_DOUBLE_EQ(model->dof_armature[model->jnt_dofadr[joint]], 0.1);
      // The principal moments keep their sum: the trace of the tensor in the URDF.
      const auto& inertial = *urdf_model->getLink(mj_id2name(model.get(), mjOBJ_BODY, body))->inertial;
      const mjtNum* moments = model->body_inertia + 3 * body;
      EXPECT_NEAR(moments[0] + moments[1] + moments[2], inertial.ixx + inertial.iyy + inertial.izz, 1e-9);
    }
  }
}

TEST(Urdf, ReadsOnlyWhatItCanRepresent) {
  const std::string file = testing::TempDir() + "/feeler_bad.urdf";
  const auto emit = [&](const std::string& text) {
    std::ofstream(file) << text;
    RobotAlone(file);
  };
  EXPECT_THROW(RobotAlone("/nonexistent.urdf"), InputError);
  EXPECT_THROW(emit("<robot name='r'><link name='a'/>"), InputError);
  EXPECT_THROW(emit("no xml at all"), InputError);
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>";
  const std::string revolute =
      "<joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>"
      "<limit lower='-1' upper='1' effort='1' velocity='1'/></joint></robot>";
  EXPECT_NO_THROW(emit("<robot name='r'><link name='a'/><link name='b'>" + inertial + "</link>" + revolute));
  EXPECT_THROW(emit("<robot name='r'><link name='a'/><link name='b'/>" + revolute), InputError);
  EXPECT_THROW(emit("<robot name='r'><link name='a'/><link name='b'>" + inertial +
                    "</link><joint name='j' type='floating'><parent link='a'/><child link='b'/></joint></robot>"),
               InputError);
  EXPECT_THROW(emit("<robot name='r'><link name='a'/><link name='b'>" + inertial +
                    "<collision><geometry><mesh filename='x.stl'/></geometry></collision></link>" + revolute),
               InputError);
}

}  // namespace
}  // namespace feeler::env
