#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/task.h"
#include "feeler/env/arm/ur10e.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/model/randomization.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/scene/scene_cameras.h"

namespace feeler::env {

/// What a geom belongs to. The gripper is part of the robot; everything that is not robot, tool or target (bench,
/// panel, fixtures of the task file) is environment.
enum class ScenePart : std::uint8_t { kRobot, kTool, kTarget, kEnvironment };

struct SceneOptions {
  double timestep_s = 0.001;
  /// Coulomb friction of the joints, Nm, unknown to the controller. Zero: an ideal arm. See kRealisticJointFriction.
  std::array<double, kJointCount> joint_friction_nm{};
  /// Rotor inertia seen at each joint, kg m^2; also what keeps the wrist numerically calm at 1 ms.
  double armature_kg_m2 = 0.1;
  double contact_friction = 0.3;  ///< sliding friction where the task file gives none
  bool workbench = true;          ///< a bench under robot and fixtures and a floor, unless the task file has its own
  int max_constraints = 200;      ///< njmax; at this value more where the parts need it
  int max_contacts = 100;         ///< nconmax; the same
  SceneCameras cameras;           ///< seen and seeing, never felt
  /// Of the springs that the gripper holds the tool by, along each axis of the tool, N/m; 0: rigidly. See Wrist.
  double wrist_stiffness_n_m = 0.0;
};

/// Large joints 3 Nm, wrists 1.2 Nm.
inline constexpr std::array<double, kJointCount> kRealisticJointFriction = {3.0, 3.0, 3.0, 1.2, 1.2, 1.2};

/// Compliance in the wrist: the tool slides along its three axes, on springs damped critically for its mass, between
/// stops; it cannot turn. The device is an instrumented one: the robot knows how far the tool has given way. In the
/// nominal orientation the springs carry the weight of the tool, so that it does not sag.
struct Wrist {
  static constexpr double kTravel_m = 5e-3;     ///< to the stops, either way
  static constexpr double kSoftest_n_m = 2e3;   ///< reaches the stops at twice what counts as a contact
  static constexpr double kStiffest_n_m = 1e6;  ///< of a wrist that gives way at all

  double stiffness_n_m = 0.0;  ///< 0: no wrist, the tool is held rigidly
  double damping_n_s_m = 0.0;
  std::array<int, 3> qpos{};  ///< addresses in qpos, along x, y, z of the tool
  std::array<int, 3> dof{};   ///< addresses in qvel
};

/// A compiled world: UR10e, gripper, tool (held at task.flange_T_tool), target (a mocap body, so that its pose
/// lives in mjData and one model serves all episodes), fixtures. World frame = robot base frame (`base_link`).
///
/// Immutable and shared: copy the struct freely, use one mjData per thread. Actuator i is a motor on joint i with gear
/// one and the torque limit of the joint as control range: ctrl is a torque in Nm.
/// `lid*` geoms of target and tool are kept (contype = conaffinity = 0, group kLidGroup, not drawn) and collide with
/// nothing.
struct Scene {
  static constexpr int kVisualGroup = 2;     ///< robot geoms that are only drawn
  static constexpr int kCollisionGroup = 3;  ///< robot geoms that only collide; not drawn
  static constexpr int kLidGroup = 4;

  Task task;
  Randomization randomization;
  std::shared_ptr<const mjModel> model;  ///< for physics: only what can touch, and the lids
  /// For pictures: with all that is only seen. Same bodies and joints; geoms have other numbers. CopyForDrawing.
  std::shared_ptr<const mjModel> drawn_model;
  std::string xml;  ///< the assembled MJCF, for people and for tests

  std::array<int, kJointCount> joint{};     ///< mjModel joint ids
  std::array<int, kJointCount> qpos{};      ///< addresses in qpos
  std::array<int, kJointCount> dof{};       ///< addresses in qvel
  std::array<int, kJointCount> actuator{};  ///< indices in ctrl
  int flange_body = -1;                     ///< body `tool0`
  int tool_body = -1;
  int tool_site = -1;  ///< site at the tool reference point, axes of the tool frame
  int target_body = -1;
  int target_mocap = -1;  ///< row in mocap_pos and mocap_quat

  std::vector<ScenePart> geom_part;    ///< per geom
  std::vector<int> robot_geoms;        ///< geoms that can collide, gripper included
  std::vector<int> tool_geoms;         ///< geoms that can collide
  std::vector<int> target_geoms;       ///< geoms that can collide (no lids)
  std::vector<int> environment_geoms;  ///< geoms that can collide
  std::vector<int> lid_geoms;

  JointVector home_q_rad = JointVector::Zero();  ///< arm up front, tool pointing down
  JointVector torque_limit_nm = JointVector::Zero();
  JointVector velocity_limit_rad_s = JointVector::Zero();
  Pose flange_T_tool = Pose::Identity();  ///< where a wrist is at rest
  Wrist wrist;
};

/// Assembles and compiles the scene of a loaded task. The robot comes from robots/ur10e.urdf under ModelsFolder(); a
/// gripper between flange and tool is fitted to the tool. Global settings of the task file (<option>, <size>,
/// <visual>) give way to those of the scene where both speak.
/// Throws InputError when tool or target have joints, a name is used by task and robot, the springs of a wrist are
/// stiffer than the time step bears with this tool, or the whole does not compile.
Scene BuildScene(const TaskModel& task, const SceneOptions& options = {});

/// The same with all inputs spelled out. `task_xml` is MJCF text with bodies `tool` and `target` directly in the
/// world, includes in place and file names absolute.
Scene BuildScene(const Task& task, const std::string& task_xml, const std::string& models_folder,
                 const SceneOptions& options = {});

/// Joints at `q_rad`, at rest, target at its nominal pose, time zero, all else cleared; positions, contacts and
/// velocities up to date, forces not yet.
void ResetScene(const Scene& scene, const JointVector& q_rad, mjData& data);

/// The state of physics into data of `scene.drawn_model`, ready for a Renderer.
void CopyForDrawing(const Scene& scene, const mjData& state, mjData& drawn);

/// Moves the target; call mj_forward (or step) afterwards.
void SetTargetPose(const Scene& scene, const Pose& world_T_target, mjData& data);

/// How far the tool has given way in the wrist, m, axes of the tool. Zero for a tool that is held rigidly.
Eigen::Vector3d WristDeflection(const Scene& scene, const mjData& data);
Eigen::Vector3d WristVelocity(const Scene& scene, const mjData& data);

JointVector JointPositions(const Scene& scene, const mjData& data);
JointVector JointVelocities(const Scene& scene, const mjData& data);
void SetJointPositions(const Scene& scene, const JointVector& q_rad, mjData& data);
/// Tool and target frames in the world; mj_kinematics must be up to date.
Pose ToolPose(const Scene& scene, const mjData& data);
Pose TargetPose(const Scene& scene, const mjData& data);

/// All joint configurations within +-pi that put the tool at `world_T_tool`; empty when out of reach.
std::vector<JointVector> ToolInverseKinematics(const Scene& scene, const Pose& world_T_tool);
/// With a wrist at rest.
Pose ToolForwardKinematics(const Scene& scene, const JointVector& q_rad);

}  // namespace feeler::env
