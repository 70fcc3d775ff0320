#include "feeler/env/scene/scene.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>
#include <numbers>
#include <string_view>

#include "feeler/core/error.h"
#include "feeler/core/text/plain_locale.h"
#include "feeler/env/arm/urdf_to_mjcf.h"
#include "feeler/env/model/task_finding.h"
#include "feeler/env/scene/contact_capacity.h"
#include "feeler/env/scene/gripper.h"
#include "feeler/env/scene/physics_model.h"
#include "feeler/env/scene/scene_decor.h"
#include "feeler/env/scene/wrist.h"

namespace feeler::env {
namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

void SetPoseAttributes(const Pose& pose, XMLElement& body) {
  for (const char* orientation : {"quat", "axisangle", "xyaxes", "zaxis", "euler"}) body.DeleteAttribute(orientation);
  body.SetAttribute("pos", MjcfVector(pose.translation()).c_str());
  body.SetAttribute("quat", MjcfQuaternion(pose.linear()).c_str());
}

// The body of this name directly in the world.
XMLElement& WorldBody(XMLElement& worldbody, const char* name, const std::string& where) {
  for (XMLElement* body = worldbody.FirstChildElement("body"); body != nullptr;
       body = body->NextSiblingElement("body")) {
    if (body->Attribute("name", name) != nullptr) return *body;
  }
  throw InputError(where, fmt::format("no body '{}' in <worldbody>", name),
                   fmt::format("add <body name=\"{}\"> directly under <worldbody>", name));
}

// A free joint, as one adds it to play with the part in a viewer, is dropped; any other joint is a mistake.
void MakeRigid(XMLElement& body, const std::string& where) {
  for (const char* tag : {"freejoint", "joint"}) {
    for (XMLElement* joint = body.FirstChildElement(tag); joint != nullptr;) {
      XMLElement* next = joint->NextSiblingElement(tag);
      if (std::string_view(tag) == "joint" && joint->Attribute("type", "free") == nullptr) {
        throw InputError(where,
                         fmt::format("body '{}' has a joint", body.Attribute("name") ? body.Attribute("name") : ""),
                         "tool and target are rigid: remove the joint");
      }
      body.DeleteChild(joint);
      joint = next;
    }
  }
  for (XMLElement* child = body.FirstChildElement("body"); child != nullptr;
       child = child->NextSiblingElement("body")) {
    MakeRigid(*child, where);
  }
}

// The parsed task file and where things are in it.
struct TaskDocument {
  XMLDocument document;
  XMLElement* mujoco = nullptr;
  XMLElement* worldbody = nullptr;
  XMLElement* tool = nullptr;
  XMLElement* target = nullptr;
  bool angles_in_degrees = true;
};

void Parse(const std::string& xml, const std::string& where, TaskDocument& task) {
  if (task.document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) {
    throw InputError(where, fmt::format("not well-formed XML: {}", task.document.ErrorStr()), "correct the file");
  }
  task.mujoco = task.document.FirstChildElement("mujoco");
  if (task.mujoco == nullptr) throw InputError(where, "the root element is not <mujoco>", "give an MJCF file");
  task.worldbody = task.mujoco->FirstChildElement("worldbody");
  if (task.worldbody == nullptr) throw InputError(where, "no <worldbody>", "add tool and target bodies");
  task.tool = &WorldBody(*task.worldbody, "tool", where);
  task.target = &WorldBody(*task.worldbody, "target", where);
  for (const XMLElement* compiler = task.mujoco->FirstChildElement("compiler"); compiler != nullptr;
       compiler = compiler->NextSiblingElement("compiler")) {
    if (const char* angle = compiler->Attribute("angle")) task.angles_in_degrees = std::string_view(angle) == "degree";
    if (compiler->Attribute("coordinate", "global") != nullptr) {
      throw InputError(where, "<compiler coordinate=\"global\">", "use local coordinates");
    }
  }
}

// What the scene decides leaves the task's text: key frames fit the task's own qpos only, and of two settings in
// different sections MuJoCo would take the last.
void DropGlobalSettings(XMLElement& mujoco) {
  for (const char* section : {"keyframe", "option", "size", "statistic"}) {
    while (XMLElement* element = mujoco.FirstChildElement(section)) mujoco.DeleteChild(element);
  }
}

void SetDefault(XMLElement& element, const char* attribute, const std::string& value) {
  if (element.Attribute(attribute) == nullptr) element.SetAttribute(attribute, value.c_str());
}

void AddSettings(const SceneOptions& options, XMLElement& mujoco) {
  XMLElement& option = *mujoco.InsertNewChildElement("option");
  option.SetAttribute("timestep", options.timestep_s);
  option.SetAttribute("gravity", "0 0 -9.81");
  option.SetAttribute("integrator", "Euler");
  option.SetAttribute("solver", "Newton");
  option.SetAttribute("cone", "elliptic");
  option.SetAttribute("impratio", 10);
  XMLElement& size = *mujoco.InsertNewChildElement("size");
  const int stops = options.wrist_stiffness_n_m > 0.0 ? 3 : 0;
  size.SetAttribute("njmax", options.max_constraints + stops);
  size.SetAttribute("nconmax", options.max_contacts);
  // In numbers of 8 bytes. MuJoCo's own guess is 5 njmax^2, for solvers that invert the constraint space; Newton with
  // six joints used 1500 at 50 contacts.
  size.SetAttribute("nstack", std::max(32768, 20 * options.max_constraints));

  // Contact parameters are defaults, so that a geom of the task file may have its own.
  XMLElement* defaults = mujoco.FirstChildElement("default");
  if (defaults == nullptr) {
    defaults = mujoco.InsertNewChildElement("default");
    mujoco.InsertFirstChild(defaults);
  }
  XMLElement* geom = defaults->FirstChildElement("geom");
  if (geom == nullptr) {
    geom = mujoco.GetDocument()->NewElement("geom");
    defaults->InsertFirstChild(geom);
  }
  SetDefault(*geom, "condim", "4");
  SetDefault(*geom, "friction", fmt::format("{} 0.005 0.0001", options.contact_friction));
  SetDefault(*geom, "solref", "0.01 1");
  SetDefault(*geom, "solimp", "0.95 0.99 0.0005");
}

void Check(const SceneOptions& options) {
  const auto require = [](bool good, const char* what, const char* mend) {
    if (!good) throw InputError("scene options", what, mend);
  };
  require(options.timestep_s > 0.0 && options.timestep_s <= 0.01, "time step out of range", "0 < timestep_s <= 0.01");
  require(options.armature_kg_m2 >= 0.0, "negative armature", "armature_kg_m2 >= 0");
  require(options.contact_friction >= 0.0, "negative friction", "contact_friction >= 0");
  require(options.max_constraints > 0 && options.max_contacts > 0, "no room for contacts",
          "max_constraints and max_contacts > 0");
  RequireWrist(options);
  for (const double friction : options.joint_friction_nm) {
    require(friction >= 0.0, "negative joint friction", "joint_friction_nm >= 0");
  }
}

bool Collides(const mjModel& model, int geom) {
  return model.geom_contype[geom] != 0 || model.geom_conaffinity[geom] != 0;
}

bool IsLid(const mjModel& model, int geom) {
  const char* name = mj_id2name(&model, mjOBJ_GEOM, geom);
  return name != nullptr && std::strncmp(name, "lid", 3) == 0;
}

bool Inside(const mjModel& model, int body, int ancestor) {
  while (body > ancestor) body = model.body_parentid[body];
  return body == ancestor;
}

int Find(const mjModel& model, mjtObj type, const char* name) {
  const int id = mj_name2id(&model, type, name);
  if (id < 0) throw InputError("scene", fmt::format("'{}' is missing", name), "check the robot description");
  return id;
}

// Where everything is in the compiled model.
void Index(const std::vector<RobotJoint>& joints, const char* root_body, Scene& scene) {
  const mjModel& model = *scene.model;
  if (joints.size() != kJointCount) throw InputError("scene", "the robot does not have six joints", "use a UR10e");
  for (std::size_t i = 0; i < kJointCount; ++i) {
    scene.joint[i] = Find(model, mjOBJ_JOINT, kJointNames[i]);
    scene.qpos[i] = model.jnt_qposadr[scene.joint[i]];
    scene.dof[i] = model.jnt_dofadr[scene.joint[i]];
    scene.actuator[i] = Find(model, mjOBJ_ACTUATOR, fmt::format("motor_{}", kJointNames[i]).c_str());
    const auto limits = std::find_if(joints.begin(), joints.end(),
                                     [&](const RobotJoint& joint) { return joint.name == kJointNames[i]; });
    scene.torque_limit_nm[static_cast<int>(i)] = limits->effort_nm;
    scene.velocity_limit_rad_s[static_cast<int>(i)] = limits->velocity_rad_s;
  }
  scene.flange_body = Find(model, mjOBJ_BODY, "tool0");
  scene.tool_body = Find(model, mjOBJ_BODY, "tool");
  scene.tool_site = Find(model, mjOBJ_SITE, "tool_reference");
  scene.target_body = Find(model, mjOBJ_BODY, "target");
  scene.target_mocap = model.body_mocapid[scene.target_body];
  const int robot = Find(model, mjOBJ_BODY, root_body);
  for (int geom = 0; geom < model.ngeom; ++geom) {
    const int body = model.geom_bodyid[geom];
    ScenePart part = ScenePart::kEnvironment;
    std::vector<int>* list = &scene.environment_geoms;
    if (Inside(model, body, scene.tool_body)) {
      part = ScenePart::kTool;
      list = &scene.tool_geoms;
    } else if (Inside(model, body, scene.target_body)) {
      part = ScenePart::kTarget;
      list = &scene.target_geoms;
    } else if (Inside(model, body, robot)) {
      part = ScenePart::kRobot;
      list = &scene.robot_geoms;
    }
    scene.geom_part.push_back(part);
    const bool of_task = part == ScenePart::kTarget || part == ScenePart::kTool;
    if (of_task && IsLid(model, geom)) list = &scene.lid_geoms;
    if (Collides(model, geom) || list == &scene.lid_geoms) list->push_back(geom);
  }
}

/// The arm as physics has it, from the URDF, is the one that the kinematics of env/arm/ur10e.h solve: each joint's axis
/// is where they have it, and the flange.
void RequireKinematicsOfUrdf(const Scene& scene, const std::string& urdf) {
  constexpr double kNear = 1e-5;  // m, and rad
  const DataHandle data = MakeData(*scene.model);
  JointVector q;
  q << 0.3, -1.1, 0.9, -0.4, 0.7, 0.2;
  ResetScene(scene, q, *data);
  const KinematicChain chain = Chain(q);
  for (std::size_t i = 0; i < kJointCount; ++i) {
    const Eigen::Map<const Eigen::Vector3d> axis(data->xaxis + 3 * scene.joint[i]);
    const Eigen::Map<const Eigen::Vector3d> anchor(data->xanchor + 3 * scene.joint[i]);
    const double turned = axis.cross(chain.axis[i]).norm() + (axis.dot(chain.axis[i]) < 0 ? 1.0 : 0.0);
    const double beside_m = (anchor - chain.origin_m[i]).cross(chain.axis[i]).norm();
    if (turned < kNear && beside_m < kNear) continue;
    throw InputError(
        fmt::format("{}: <joint name=\"{}\">", urdf, kJointNames[i]),
        fmt::format("its axis lies {:.3g} mm and {:.3g} rad from where the UR10e has it, by whose kinematics "
                    "the arm is moved",
                    beside_m * 1000, turned),
        "correct the <origin> of this joint, or of one before it");
  }
  const Pose flange = BodyPose(*data, scene.flange_body);
  const double off_m = (flange.translation() - chain.base_T_flange.translation()).norm();
  const double turned = Eigen::AngleAxisd(flange.linear().transpose() * chain.base_T_flange.linear()).angle();
  if (off_m < kNear && turned < kNear) return;
  throw InputError(
      fmt::format("{}: <link name=\"tool0\">", urdf),
      fmt::format("the flange lies {:.3g} mm and {:.3g} rad from where the kinematics of the UR10e have it",
                  off_m * 1000, turned),
      "correct the origins of the joints behind wrist 3");
}

// Geoms named `lid*` anywhere under `body` stay in the model for the contact map, out of physics and pictures.
void DisarmLids(XMLElement& body) {
  for (XMLElement* geom = body.FirstChildElement("geom"); geom != nullptr; geom = geom->NextSiblingElement("geom")) {
    const char* name = geom->Attribute("name");
    if (name == nullptr || std::strncmp(name, "lid", 3) != 0) continue;
    geom->SetAttribute("contype", 0);
    geom->SetAttribute("conaffinity", 0);
    geom->SetAttribute("group", Scene::kLidGroup);
  }
  for (XMLElement* child = body.FirstChildElement("body"); child != nullptr;
       child = child->NextSiblingElement("body")) {
    DisarmLids(*child);
  }
}

XMLElement* FindBody(XMLElement& body, const char* name) {
  if (body.Attribute("name", name) != nullptr) return &body;
  for (XMLElement* child = body.FirstChildElement("body"); child != nullptr;
       child = child->NextSiblingElement("body")) {
    if (XMLElement* found = FindBody(*child, name)) return found;
  }
  return nullptr;
}

Scene Assemble(const Task& task, const std::string& task_xml, const std::string& models_folder,
               const GripperFit& gripper, double tool_mass_kg, const SceneOptions& options) {
  Check(options);
  const std::string where = task.file.empty() ? "task" : task.file;
  TaskDocument doc;
  Parse(task_xml, where, doc);
  MakeRigid(*doc.tool, where);
  MakeRigid(*doc.target, where);
  DropGlobalSettings(*doc.mujoco);
  SetPoseAttributes(task.world_T_target, *doc.target);
  doc.target->SetAttribute("mocap", "true");
  DisarmLids(*doc.target);
  DisarmLids(*doc.tool);

  UrdfToMjcfOptions robot_options;
  robot_options.armature_kg_m2 = options.armature_kg_m2;
  robot_options.joint_friction_nm.assign(options.joint_friction_nm.begin(), options.joint_friction_nm.end());
  robot_options.angles_in_degrees = doc.angles_in_degrees;
  robot_options.visual_group = Scene::kVisualGroup;
  robot_options.collision_group = Scene::kCollisionGroup;
  const std::string urdf = models_folder + "/robots/ur10e.urdf";
  const RobotMjcf robot = EmitRobot(urdf, robot_options, *doc.mujoco);
  XMLElement* flange = FindBody(*robot.root_body, "tool0");
  if (flange == nullptr) throw InputError(urdf, "no link 'tool0'", "add the flange as a fixed link");
  EmitGripper(gripper, Scene::kVisualGroup, Scene::kCollisionGroup, *flange);
  flange->InsertEndChild(doc.tool);  // moves it out of the world
  SetPoseAttributes(task.flange_T_tool, *doc.tool);
  XMLElement& site = *doc.tool->InsertNewChildElement("site");
  site.SetAttribute("name", "tool_reference");
  site.SetAttribute("pos", "0 0 0");
  site.SetAttribute("quat", "1 0 0 0");
  site.SetAttribute("size", 0.001);
  site.SetAttribute("group", 5);
  AddWrist(options, task, tool_mass_kg, *doc.tool);

  AddCameras(options.cameras, gripper, task.flange_T_tool, Scene::kVisualGroup, *doc.mujoco, *flange);

  AddSettings(options, *doc.mujoco);
  AddDecor(options.workbench, *doc.mujoco);

  tinyxml2::XMLPrinter printer;
  doc.document.Print(&printer);
  Scene scene;
  scene.task = task;
  scene.xml = printer.CStr();
  scene.drawn_model = std::shared_ptr<const mjModel>(CompileMjcf(scene.xml, where).release(), ModelDeleter());
  scene.model = CompilePhysicsModel(scene.xml, scene.drawn_model, Scene::kLidGroup, where);
  scene.flange_T_tool = task.flange_T_tool;
  scene.randomization = ReadRandomization(*scene.drawn_model, where);
  Index(robot.joints, robot.root_body->Attribute("name"), scene);
  scene.wrist = FindWrist(options, *scene.model);
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  scene.home_q_rad << 0.0, -kQuarter, kQuarter, -kQuarter, -kQuarter, 0.0;
  RequireKinematicsOfUrdf(scene, urdf);
  return scene;
}

}  // namespace

namespace {

/// A tool that the gripper has no place for, or the arm no strength, fails here, by name, before anything moves.
void RequireHoldable(const GripperFit& gripper, const Task& task, double tool_mass_kg) {
  for (const TaskFinding& finding : HoldFindings(gripper, task, tool_mass_kg, task.file.empty() ? "task" : task.file)) {
    if (finding.kind == "fingers" || finding.kind == "payload") RequireNoError({finding});
  }
}

}  // namespace

Scene BuildScene(const TaskModel& task, const SceneOptions& options) {
  const PlainLocale plain;
  const GripperFit gripper = FitGripper(*task.model, task.tool_geoms, task.tool_body, task.task.flange_T_tool);
  RequireHoldable(gripper, task.task, task.model->body_subtreemass[task.tool_body]);
  SceneOptions sized = options;
  const SceneOptions least;
  if (options.max_constraints == least.max_constraints && options.max_contacts == least.max_contacts) {
    const ContactCapacity capacity = CapacityFor(task);
    sized.max_constraints = capacity.rows;
    sized.max_contacts = capacity.contacts;
  }
  return Assemble(task.task, task.xml, ModelsFolder().string(), gripper, task.model->body_subtreemass[task.tool_body],
                  sized);
}

Scene BuildScene(const Task& task, const std::string& task_xml, const std::string& models_folder,
                 const SceneOptions& options) {
  const PlainLocale plain;
  const std::string where = task.file.empty() ? "task" : task.file;
  const ModelHandle alone = CompileMjcf(task_xml, where);
  const int tool_body = mj_name2id(alone.get(), mjOBJ_BODY, "tool");
  std::vector<int> tool_geoms;
  for (int geom = 0; geom < alone->ngeom; ++geom) {
    if (tool_body > 0 && Inside(*alone, alone->geom_bodyid[geom], tool_body) && Collides(*alone, geom)) {
      tool_geoms.push_back(geom);
    }
  }
  const GripperFit gripper =
      tool_body > 0 ? FitGripper(*alone, tool_geoms, tool_body, task.flange_T_tool) : GripperFit{};
  const double tool_mass_kg = tool_body > 0 ? alone->body_subtreemass[tool_body] : 0.0;
  return Assemble(task, task_xml, models_folder, gripper, tool_mass_kg, options);
}

void ResetScene(const Scene& scene, const JointVector& q_rad, mjData& data) {
  mj_resetData(scene.model.get(), &data);
  SetJointPositions(scene, q_rad, data);
  SetTargetPose(scene, scene.task.world_T_target, data);
  mj_fwdPosition(scene.model.get(), &data);
  mj_fwdVelocity(scene.model.get(), &data);
}

void CopyForDrawing(const Scene& scene, const mjData& state, mjData& drawn) {
  const mjModel* model = scene.drawn_model.get();
  drawn.time = state.time;
  std::copy(state.qpos, state.qpos + model->nq, drawn.qpos);
  std::copy(state.mocap_pos, state.mocap_pos + 3 * model->nmocap, drawn.mocap_pos);
  std::copy(state.mocap_quat, state.mocap_quat + 4 * model->nmocap, drawn.mocap_quat);
  mj_kinematics(model, &drawn);
  mj_comPos(model, &drawn);
  mj_camlight(model, &drawn);
}

void SetTargetPose(const Scene& scene, const Pose& world_T_target, mjData& data) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(world_T_target.linear()).normalized();
  mjtNum* quat = data.mocap_quat + 4 * scene.target_mocap;
  quat[0] = q.w();
  quat[1] = q.x();
  quat[2] = q.y();
  quat[3] = q.z();
  Eigen::Map<Eigen::Vector3d>(data.mocap_pos + 3 * scene.target_mocap) = world_T_target.translation();
}

Eigen::Vector3d WristDeflection(const Scene& scene, const mjData& data) {
  if (scene.wrist.stiffness_n_m == 0.0) return Eigen::Vector3d::Zero();
  return {data.qpos[scene.wrist.qpos[0]], data.qpos[scene.wrist.qpos[1]], data.qpos[scene.wrist.qpos[2]]};
}

Eigen::Vector3d WristVelocity(const Scene& scene, const mjData& data) {
  if (scene.wrist.stiffness_n_m == 0.0) return Eigen::Vector3d::Zero();
  return {data.qvel[scene.wrist.dof[0]], data.qvel[scene.wrist.dof[1]], data.qvel[scene.wrist.dof[2]]};
}

JointVector JointPositions(const Scene& scene, const mjData& data) {
  JointVector q;
  for (int i = 0; i < kJointCount; ++i) q[i] = data.qpos[scene.qpos[static_cast<std::size_t>(i)]];
  return q;
}

JointVector JointVelocities(const Scene& scene, const mjData& data) {
  JointVector qd;
  for (int i = 0; i < kJointCount; ++i) qd[i] = data.qvel[scene.dof[static_cast<std::size_t>(i)]];
  return qd;
}

void SetJointPositions(const Scene& scene, const JointVector& q_rad, mjData& data) {
  for (int i = 0; i < kJointCount; ++i) data.qpos[scene.qpos[static_cast<std::size_t>(i)]] = q_rad[i];
}

Pose ToolPose(const Scene& scene, const mjData& data) { return BodyPose(data, scene.tool_body); }

Pose TargetPose(const Scene& scene, const mjData& data) { return BodyPose(data, scene.target_body); }

std::vector<JointVector> ToolInverseKinematics(const Scene& scene, const Pose& world_T_tool) {
  return InverseKinematics(world_T_tool * scene.flange_T_tool.inverse());
}

Pose ToolForwardKinematics(const Scene& scene, const JointVector& q_rad) {
  return ForwardKinematics(q_rad) * scene.flange_T_tool;
}

}  // namespace feeler::env
