#pragma once

#include <optional>

#include "feeler/core/pose.h"

namespace tinyxml2 {
class XMLElement;
}

namespace feeler::env {

struct GripperFit;

/// Names of the cameras that every scene has.
inline constexpr const char* kStaticCamera = "static";
inline constexpr const char* kWristCamera = "wrist";

/// Where the cameras of a scene stand. Camera frames are x right, y down, z forward. A camera of the same name in the
/// task file takes the place of ours.
struct SceneCameras {
  /// A depth camera on a mast, beyond the reach of the arm (which the mast does not obstruct), so placed that it looks
  /// past the arm at home onto the ports that the arm can reach.
  Pose world_T_static = LookAt({1.4, -0.4, 1.2}, {0.55, -0.02, 0.2}, Eigen::Vector3d::UnitZ());
  double static_fovy_deg = 65.0;  ///< of the Azure Kinect's narrow depth mode at 640 x 576 pixels
  /// A colour camera on the flange; empty: beside the gripper, across its closing direction, looking at the tip of the
  /// tool and what is in front of it.
  std::optional<Pose> flange_T_wrist;
  double wrist_fovy_deg = 42.0;  ///< of the RealSense D435i's colour camera
  bool housings = true;          ///< draw mast, bracket and housings

  /// A camera at `eye` that has `centre` in the middle of its picture and `up` upwards in it.
  static Pose LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& centre, const Eigen::Vector3d& up);
};

/// Where the wrist camera sits when nothing else is said, in the frame of the flange.
Pose DefaultWristCamera(const GripperFit& gripper, const Pose& flange_T_tool);

/// Adds both cameras to the document: a <camera> in the world and one on the flange, with what is drawn of them.
/// Nothing of it has mass or collides.
void AddCameras(const SceneCameras& cameras, const GripperFit& gripper, const Pose& flange_T_tool, int visual_group,
                tinyxml2::XMLElement& mujoco, tinyxml2::XMLElement& flange_body);

}  // namespace feeler::env
