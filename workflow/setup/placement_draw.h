#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/random.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/robot/transfer_checker.h"
#include "feeler/env/scene/scene.h"

namespace feeler::workflow {

/// Where the target of an episode stands before uncertainty comes into it.
enum class Placement {
  kNominal,    ///< where the task file puts it
  kWorkspace,  ///< anywhere in the workspace that the robot can serve
};
std::string_view ToString(Placement placement);
/// "nominal" or "workspace". Throws InputError for anything else.
Placement ParsePlacement(std::string_view text);

/// The volume in which targets are placed: the paper's cube of 2 m and its yaw of +-15 degrees (Sec. V-A), standing on
/// the plane of the robot's base.
struct Workspace {
  Eigen::Vector3d lower_m{-1.0, -1.0, 0.0};  ///< in the world, of the origin of the target
  Eigen::Vector3d upper_m{1.0, 1.0, 2.0};
  double yaw_rad = 15.0 * std::numbers::pi / 180.0;  ///< about the vertical, either way of the nominal orientation
};

struct PlacementDraw {
  Pose world_T_target = Pose::Identity();
  int rejected = 0;  ///< draws that the robot cannot serve, before the one returned
};

/// Draws poses of the target, uniform in the part of a workspace that the robot can serve: the target overlaps no
/// fixture and, wherever it stands in the task's largest box of hypotheses, not the arm at home, and every branch of
/// the inverse kinematics that stands free at the start pose (there is one) moves from there to the corners of the
/// tool's workspace, stands free at the inserted pose, and as deep beside the target meets no fixture. Not thread-safe
/// (it holds collision checkers): one per thread.
class PlacementSampler {
 public:
  explicit PlacementSampler(std::shared_ptr<const env::Scene> scene, const Workspace& workspace = {});

  /// Draws until a pose is served and, where given, `accept` agrees (asked last). Throws InputError when 100,000 draws
  /// in a row are rejected.
  PlacementDraw Draw(RandomStream& random, const std::function<bool(const Pose&)>& accept = {});

  /// Why the robot cannot serve a target at this pose; empty if it can.
  std::string Obstacle(const Pose& world_T_target);

 private:
  bool TargetIsFree(const Pose& world_T_target);
  bool BranchServes(const env::JointVector& start_rad, const Pose& world_T_target);

  std::shared_ptr<const env::Scene> scene_;
  Workspace workspace_;
  std::vector<int> largest_;             ///< extents, one per axis of the task
  env::TransferChecker roomy_;           ///< with the clearance of transfers
  env::TransferChecker exact_;           ///< without: the inserted tool is closer to the target than any clearance
  env::TransferChecker without_target_;  ///< with the clearance of transfers, the target out of the way
  env::DataHandle data_;
};

}  // namespace feeler::workflow
