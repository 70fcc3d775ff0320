// The scene of a task: robot, gripper, tool, target, fixtures in one model. Laws:
//   tool pose in MuJoCo = FK(q) * flange_T_tool (1e-9);  the target stands where it is put;
//   every geom belongs to exactly one part; robot, gripper and tool do not collide with each other by construction;
//   home is free of contact, with a margin;  lids are in the model and never collide;
//   a task file needs nothing but tool, target and numbers: any part, in any angle unit.

#include "feeler/env/scene/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <numbers>
#include <set>

#include "feeler/core/error.h"
#include "feeler/core/random.h"

namespace feeler::env {
namespace {

const std::string kModels = std::string(FEELER_SOURCE_DIR) + "/models";

// A peg over a plate with a hole, the smallest task there is; the tool lies sideways in the file.
constexpr const char* kPegTask = R"(
<mujoco>
  <worldbody>
    <geom name="post" type="cylinder" pos="0.5 0.4 0.1" size="0.02 0.1"/>
    <body name="tool" pos="1 0 1" euler="0 90 0">
      <freejoint/>
      <geom name="peg" type="cylinder" size="0.01 0.03" pos="0 0 0.03"/>
    </body>
    <body name="target" pos="0.6 0 0.05" euler="0 0 30">
      <geom name="left" type="box" size="0.02 0.05 0.02" pos="-0.033 0 -0.02"/>
      <geom name="right" type="box" size="0.02 0.05 0.02" pos="0.033 0 -0.02"/>
      <geom name="lid" type="box" size="0.05 0.05 0.02" pos="0 0 -0.02"/>
    </body>
  </worldbody>
  <keyframe><key qpos="0 0 0 1 0 0 0"/></keyframe>
</mujoco>)";

Task PegTask() {
  Task task;
  task.name = "peg";
  task.world_T_target = MakePose(Eigen::Vector3d(0.6, 0.0, 0.05), std::numbers::pi / 6);
  task.flange_T_tool = MakePose(Eigen::Vector3d(0.0, 0.0, 0.2), Eigen::Quaterniond(0, 1, 0, 0));
  return task;
}

JointVector RandomJoints(RandomStream& random) {
  JointVector q;
  for (double& angle : q) angle = random.Uniform(-std::numbers::pi, std::numbers::pi);
  return q;
}

class SceneOf : public testing::TestWithParam<const char*> {
 protected:
  static Scene Build(const SceneOptions& options = {}) {
    if (std::string(GetParam()) == "peg") return BuildScene(PegTask(), kPegTask, kModels, options);
    return BuildScene(LoadTask(GetParam()), options);
  }
};

TEST_P(SceneOf, ToolPoseIsForwardKinematicsTimesGrasp) {
  const Scene scene = Build();
  const DataHandle data = MakeData(*scene.model);
  RandomStream random(1, 0, "scene");
  for (int sample = 0; sample < 100; ++sample) {
    const JointVector q = RandomJoints(random);
    SetJointPositions(scene, q, *data);
    EXPECT_EQ(JointPositions(scene, *data), q);
    mj_kinematics(scene.model.get(), data.get());
    const Pose expected = ForwardKinematics(q) * scene.flange_T_tool;
    EXPECT_LT((ToolPose(scene, *data).translation() - expected.translation()).norm(), 1e-9);
    EXPECT_LT((ToolPose(scene, *data).linear() - expected.linear()).norm(), 1e-9);
    EXPECT_TRUE(ToolForwardKinematics(scene, q).isApprox(expected, 1e-12));
    const auto* site = data->site_xpos + 3 * scene.tool_site;
    EXPECT_LT((Eigen::Map<const Eigen::Vector3d>(site) - expected.translation()).norm(), 1e-9);
    for (const JointVector& branch : ToolInverseKinematics(scene, expected)) {
      EXPECT_TRUE(ToolForwardKinematics(scene, branch).isApprox(expected, 1e-8));
    }
  }
}

TEST_P(SceneOf, TargetStandsWhereItIsPut) {
  const Scene scene = Build();
  const DataHandle data = MakeData(*scene.model);
  ResetScene(scene, scene.home_q_rad, *data);
  EXPECT_TRUE(TargetPose(scene, *data).isApprox(scene.task.world_T_target, 1e-12));
  const Pose moved = MakePose(Eigen::Vector3d(0.55, -0.1, 0.21), 0.4);
  SetTargetPose(scene, moved, *data);
  mj_forward(scene.model.get(), data.get());
  EXPECT_TRUE(TargetPose(scene, *data).isApprox(moved, 1e-12));
  ResetScene(scene, scene.home_q_rad, *data);
  EXPECT_TRUE(TargetPose(scene, *data).isApprox(scene.task.world_T_target, 1e-12));
}

TEST_P(SceneOf, EveryGeomBelongsToOnePart) {
  const Scene scene = Build();
  const mjModel& model = *scene.model;
  ASSERT_EQ(scene.geom_part.size(), static_cast<std::size_t>(model.ngeom));
  std::set<int> seen;
  for (const auto* list :
       {&scene.robot_geoms, &scene.tool_geoms, &scene.target_geoms, &scene.environment_geoms, &scene.lid_geoms}) {
    EXPECT_FALSE(list->empty());
    for (const int geom : *list) EXPECT_TRUE(seen.insert(geom).second);
  }
  for (int geom = 0; geom < model.ngeom; ++geom) {
    const bool collides = model.geom_contype[geom] != 0 || model.geom_conaffinity[geom] != 0;
    EXPECT_TRUE(!collides || seen.contains(geom));
  }
  for (const int geom : scene.lid_geoms) {
    EXPECT_EQ(model.geom_contype[geom] | model.geom_conaffinity[geom], 0);
    EXPECT_EQ(model.geom_group[geom], Scene::kLidGroup);
  }
}

TEST_P(SceneOf, HomeIsFree) {
  const Scene scene = Build();
  ModelHandle margin(mj_copyModel(nullptr, scene.model.get()));
  for (int geom = 0; geom < margin->ngeom; ++geom) margin->geom_margin[geom] = 0.01;
  const DataHandle data = MakeData(*margin);
  ResetScene(scene, scene.home_q_rad, *data);
  mj_forward(margin.get(), data.get());
  EXPECT_EQ(data->ncon, 0);
  for (int i = 0; i < data->ncon; ++i) {
    const auto name = [&](int geom) { return mj_id2name(margin.get(), mjOBJ_BODY, margin->geom_bodyid[geom]); };
    ADD_FAILURE() << name(data->contact[i].geom1) << " - " << name(data->contact[i].geom2);
  }
  EXPECT_TRUE(TakeMujocoWarning().empty());
}

TEST_P(SceneOf, FallsAndCollidesUnderGravityWithoutWarnings) {
  const Scene scene = Build();
  const DataHandle data = MakeData(*scene.model);
  ResetScene(scene, scene.home_q_rad, *data);
  int contacts = 0;
  for (int step = 0; step < 3000; ++step) {
    mj_step(scene.model.get(), data.get());
    contacts = std::max(contacts, data->ncon);
    for (int i = 0; i < data->ncon; ++i) {
      std::set<std::string> pair;
      for (const int geom : {data->contact[i].geom1, data->contact[i].geom2}) {
        pair.insert(mj_id2name(scene.model.get(), mjOBJ_BODY, scene.model->geom_bodyid[geom]));
      }
      for (const std::string held : {"tool", "gripper"}) {
        for (const std::string near : {"tool", "gripper", "wrist_3_link", "wrist_2_link"}) {
          EXPECT_FALSE(pair == (std::set<std::string>{held, near})) << held << " touches " << near;
        }
      }
    }
  }
  EXPECT_GT(contacts, 0) << "a limp arm must hit something";
  EXPECT_EQ(TakeMujocoWarning(), "");
}

TEST_P(SceneOf, GravityTorqueHoldsTheArm) {
  // Inverse dynamics of the model at rest, applied through the motors, keeps the arm at rest: motors are torques.
  const Scene scene = Build();
  const DataHandle data = MakeData(*scene.model);
  ResetScene(scene, scene.home_q_rad, *data);
  for (int step = 0; step < 200; ++step) {
    mj_forward(scene.model.get(), data.get());
    for (std::size_t i = 0; i < kJointCount; ++i) {
      const double torque = data->qfrc_bias[scene.dof[i]];
      EXPECT_LT(std::abs(torque), scene.torque_limit_nm[static_cast<int>(i)]);
      data->ctrl[scene.actuator[i]] = torque;
    }
    mj_step(scene.model.get(), data.get());
  }
  EXPECT_LT((JointPositions(scene, *data) - scene.home_q_rad).norm(), 1e-6);
}

TEST_P(SceneOf, IsSmallAndQuick) {
  const auto begin = std::chrono::steady_clock::now();
  const Scene scene = Build();
  const double build_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  const DataHandle data = MakeData(*scene.model);
  RecordProperty("build_ms", std::to_string(build_ms));
  RecordProperty("data_bytes", std::to_string(data->nbuffer + static_cast<int>(data->nstack * 8)));
  EXPECT_LT(data->nbuffer + data->nstack * 8, 3e6);
}

INSTANTIATE_TEST_SUITE_P(Tasks, SceneOf, testing::Values("peg", "plug"),
                         [](const auto& tested) { return std::string(tested.param); });

TEST(Scene, OptionsArrive) {
  SceneOptions options;
  options.timestep_s = 0.0005;
  options.joint_friction_nm = kRealisticJointFriction;
  options.contact_friction = 0.7;
  const Scene scene = BuildScene(PegTask(), kPegTask, kModels, options);
  EXPECT_DOUBLE_EQ(scene.model->opt.timestep, 0.0005);
  for (std::size_t i = 0; i < kJointCount; ++i) {
    EXPECT_DOUBLE_EQ(scene.model->dof_frictionloss[scene.dof[i]], kRealisticJointFriction[i]);
  }
  for (const int geom : scene.target_geoms) EXPECT_DOUBLE_EQ(scene.model->geom_friction[3 * geom], 0.7);
  options.timestep_s = -1.0;
  EXPECT_THROW(BuildScene(PegTask(), kPegTask, kModels, options), InputError);
}

TEST(Scene, GripperHoldsTheToolFromBothSides) {
  const Scene scene = BuildScene(PegTask(), kPegTask, kModels);
  const mjModel& model = *scene.model;
  const int gripper = mj_name2id(&model, mjOBJ_BODY, "gripper");
  ASSERT_GE(gripper, 0);
  // The peg has radius 0.01 m and ends 0.14 m from the flange: geoms of the gripper reach past that end on both sides
  // of it, and none is inside it.
  int sides = 0;
  for (int geom = model.body_geomadr[gripper]; geom < model.body_geomadr[gripper] + model.body_geomnum[gripper];
       ++geom) {
    const mjtNum* pos = model.geom_pos + 3 * geom;
    const mjtNum* size = model.geom_size + 3 * geom;
    if (model.geom_type[geom] != mjGEOM_BOX || pos[2] + size[2] < 0.1401) continue;
    EXPECT_GE(std::abs(pos[0]) - size[0], 0.01 - 1e-9);
    sides |= pos[0] > 0 ? 1 : 2;
  }
  EXPECT_EQ(sides, 3);
}

TEST(Scene, SaysWhatIsWrongWithATask) {
  const auto build = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return BuildScene(PegTask(), text, kModels);
  };
  EXPECT_THROW(build(kPegTask, "name=\"target\"", "name=\"other\""), InputError);
  EXPECT_THROW(build(kPegTask, "name=\"tool\"", "name=\"other\""), InputError);
  EXPECT_THROW(build(kPegTask, "<freejoint/>", "<joint type=\"hinge\"/>"), InputError);
  EXPECT_THROW(build(kPegTask, "name=\"post\"", "name=\"peg\""), InputError);
  EXPECT_THROW(build(kPegTask, "</mujoco>", ""), InputError);
  EXPECT_THROW(BuildScene(PegTask(), kPegTask, "/nonexistent"), InputError);
}

}  // namespace
}  // namespace feeler::env
