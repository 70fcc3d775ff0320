#include "feeler/env/scene/scene_cameras.h"

#include <tinyxml2.h>

#include <string>

#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/scene/gripper.h"

namespace feeler::env {
namespace {

using tinyxml2::XMLElement;

bool HasCamera(const XMLElement& body, const char* name) {
  for (const XMLElement* child = body.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    const std::string tag = child->Name();
    if (tag == "camera" && child->Attribute("name", name) != nullptr) return true;
    if (tag == "body" && HasCamera(*child, name)) return true;
  }
  return false;
}

void AddCamera(const char* name, const Pose& pose, double fovy_deg, XMLElement& body) {
  // MuJoCo's cameras look along -z with y upwards.
  Eigen::Matrix3d axes = pose.linear();
  axes.rightCols<2>() *= -1.0;
  XMLElement& camera = *body.InsertNewChildElement("camera");
  camera.SetAttribute("name", name);
  camera.SetAttribute("pos", MjcfVector(pose.translation()).c_str());
  camera.SetAttribute("quat", MjcfQuaternion(axes).c_str());
  camera.SetAttribute("fovy", fovy_deg);
}

void AddDrawnBox(const Pose& pose, const Eigen::Vector3d& half, const char* material, int group, XMLElement& body) {
  XMLElement& geom = *body.InsertNewChildElement("geom");
  geom.SetAttribute("type", "box");
  geom.SetAttribute("pos", MjcfVector(pose.translation()).c_str());
  geom.SetAttribute("quat", MjcfQuaternion(pose.linear()).c_str());
  geom.SetAttribute("size", MjcfVector(half).c_str());
  geom.SetAttribute("material", material);
  geom.SetAttribute("group", group);
  geom.SetAttribute("contype", 0);
  geom.SetAttribute("conaffinity", 0);
  geom.SetAttribute("mass", 0);
}

// A housing whose front is just behind the eye, so that no camera sees its own.
void AddHousing(const Pose& camera, const Eigen::Vector3d& half, int group, XMLElement& body) {
  constexpr double kBehindEye_m = 0.002;
  AddDrawnBox(camera * Eigen::Translation3d(0, 0, -half.z() - kBehindEye_m), half, "gripper_body", group, body);
}

}  // namespace

Pose SceneCameras::LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& centre, const Eigen::Vector3d& up) {
  Pose pose = Pose::Identity();
  const Eigen::Vector3d forward = (centre - eye).normalized();
  pose.translation() = eye;
  pose.linear().col(0) = forward.cross(up).normalized();
  pose.linear().col(1) = forward.cross(pose.linear().col(0));
  pose.linear().col(2) = forward;
  return pose;
}

Pose DefaultWristCamera(const GripperFit& gripper, const Pose& flange_T_tool) {
  // Far enough to the side to look past palm and fingers, near enough to hit nothing that the gripper does not.
  constexpr double kAside_m = 0.08;
  constexpr double kForward_m = 0.04;
  // The middle of the picture lies a little beyond the tip of the tool and on the camera's side of it: there is the
  // part of the target that the tool does not hide.
  constexpr double kBeyondTip_m = 0.02;
  constexpr double kAsideOfTip_m = 0.01;
  const Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d side = ahead.cross(gripper.closing_axis);
  return SceneCameras::LookAt(kAside_m * side + kForward_m * ahead,
                              flange_T_tool.translation() + kBeyondTip_m * ahead + kAsideOfTip_m * side, -side);
}

void AddCameras(const SceneCameras& cameras, const GripperFit& gripper, const Pose& flange_T_tool, int visual_group,
                XMLElement& mujoco, XMLElement& flange_body) {
  XMLElement& worldbody = *mujoco.FirstChildElement("worldbody");
  if (!HasCamera(worldbody, kStaticCamera)) {
    const Pose& pose = cameras.world_T_static;
    AddCamera(kStaticCamera, pose, cameras.static_fovy_deg, worldbody);
    if (cameras.housings) {
      const Eigen::Vector3d half(0.052, 0.02, 0.06);  // of an Azure Kinect
      AddHousing(pose, half, visual_group, worldbody);
      constexpr double kFloor_m = -0.82;  // of the scene's decor
      const Eigen::Vector3d behind = pose * Eigen::Vector3d(0, half.y() + 0.02, -half.z());
      const double half_height = 0.5 * (behind.z() - kFloor_m);
      AddDrawnBox(MakePose(Eigen::Vector3d(behind.x(), behind.y(), kFloor_m + half_height)),
                  {0.015, 0.015, half_height}, "gripper_metal", visual_group, worldbody);
    }
  }
  if (!HasCamera(worldbody, kWristCamera)) {
    const Pose pose = cameras.flange_T_wrist.value_or(DefaultWristCamera(gripper, flange_T_tool));
    AddCamera(kWristCamera, pose, cameras.wrist_fovy_deg, flange_body);
    XMLElement* body = flange_body.FirstChildElement("body");
    while (body != nullptr && body->Attribute("name", "gripper") == nullptr) body = body->NextSiblingElement("body");
    if (cameras.housings && body != nullptr) {
      // Drawn on the gripper, because a body of drawn shapes alone, without mass, does not compile.
      Pose gripper_T_flange = Pose::Identity();
      const Eigen::Vector3d side = Eigen::Vector3d::UnitZ().cross(gripper.closing_axis);
      gripper_T_flange.linear().row(0) = gripper.closing_axis;
      gripper_T_flange.linear().row(1) = side;
      AddHousing(gripper_T_flange * pose, {0.045, 0.0125, 0.0125}, visual_group, *body);  // of a RealSense D435i
      const double reach = pose.translation().dot(side);
      if (reach > 0.0) {
        AddDrawnBox(MakePose(Eigen::Vector3d(0, 0.5 * reach, 0.006)), {0.012, 0.5 * reach, 0.003}, "gripper_metal",
                    visual_group, *body);
      }
    }
  }
}

}  // namespace feeler::env
