#include "feeler/workflow/assembly/assembly_reach.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "feeler/env/robot/tool_kinematics.h"

namespace feeler::workflow {
namespace {

/// How far any joint may turn between the start pose and the places around it, and how fast for the way of the tool: a
/// branch that has to turn farther or faster is near a singularity, where straight motions crawl or end.
constexpr double kMostJointTurn_rad = 1.2;
constexpr double kMostTurn_rad_m = 12.0;
/// A hair short of the end, where a part may stand on a floor.
constexpr double kShort_m = 5e-4;

/// Whether the tool can move along any direction without the joints having to race: far enough from a singularity.
bool MovesFreely(const env::Scene& scene, const env::JointVector& q_rad) {
  const Eigen::PartialPivLU<env::Matrix6> jacobian(env::ToolJacobian(scene, q_rad));
  const env::Matrix6 inverse = jacobian.inverse();
  if (!inverse.allFinite()) return false;
  for (int joint = 0; joint < env::kJointCount; ++joint) {
    if (inverse.row(joint).head<3>().norm() > kMostTurn_rad_m) return false;
  }
  return true;
}

/// Straight from where the tool is at `from_rad` to `goal`.
std::optional<env::JointVector> Follow(const env::Scene& scene, const env::JointVector& from_rad, const Pose& goal) {
  constexpr int kSteps = 4;
  const Pose from = env::ToolForwardKinematics(scene, from_rad);
  const Eigen::Quaterniond from_turn(from.linear());
  const Eigen::Quaterniond goal_turn(goal.linear());
  env::JointVector q = from_rad;
  for (int i = 1; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    const Pose pose =
        MakePose((1.0 - share) * from.translation() + share * goal.translation(), from_turn.slerp(share, goal_turn));
    if (!env::SolveNearby(scene, pose, q, kMostJointTurn_rad / kSteps)) return std::nullopt;
    if (!MovesFreely(scene, q)) return std::nullopt;
  }
  return q;
}

/// The branches that nothing is in the way of; what is in the way of the last, if none is left.
template <class Obstacle>
ServingBranches Serving(const std::vector<env::JointVector>& branches, const Obstacle& obstacle_of) {
  ServingBranches serving;
  serving.obstacle = "out of reach";
  for (const env::JointVector& q : branches) {
    std::string obstacle = obstacle_of(q);
    if (obstacle.empty()) {
      serving.q_rad.push_back(q);
    } else {
      serving.obstacle = std::move(obstacle);
    }
  }
  if (!serving.q_rad.empty()) serving.obstacle.clear();
  return serving;
}

}  // namespace

StageReach::StageReach(std::shared_ptr<const env::Scene> scene)
    : scene_(std::move(scene)), roomy_(*scene_), exact_(*scene_, 0.0), data_(env::MakeData(*scene_->model)) {}

std::string StageReach::ArmCollision(const env::JointVector& q_rad, const Pose& world_T_target) {
  const mjModel& model = *scene_->model;
  env::SetJointPositions(*scene_, q_rad, *data_);
  env::SetTargetPose(*scene_, world_T_target, *data_);
  mj_kinematics(&model, data_.get());
  mj_collision(&model, data_.get());
  env::TakeMujocoWarning();  // a full buffer holds contacts enough
  const auto part = [&](int geom) { return scene_->geom_part[static_cast<std::size_t>(geom)]; };
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    if (part(contact.geom1) == env::ScenePart::kTool || part(contact.geom2) == env::ScenePart::kTool) continue;
    return env::NameOfGeom(model, contact.geom1) + " and " + env::NameOfGeom(model, contact.geom2);
  }
  return "";
}

std::string StageReach::Approaches(const env::JointVector& q_rad, const Pose& world_T_grasp) {
  if (!roomy_.Free(q_rad)) return roomy_.Collision(q_rad);
  const Eigen::Vector3d outward = -UnitVector(scene_->task.insertion);
  env::JointVector q = q_rad;
  for (const double way_m : {0.5 * kApproach_m, 0.0}) {
    const auto next = Follow(*scene_, q, world_T_grasp * Eigen::Translation3d(way_m * outward));
    if (!next) return "the straight way to it is out of reach";
    q = *next;
    if (!exact_.Free(q)) return exact_.Collision(q);
  }
  return "";
}

ServingBranches StageReach::AtApproach(const Pose& world_T_grasp) {
  roomy_.SetTargetPoses({scene_->task.world_T_target});
  exact_.SetTargetPoses({scene_->task.world_T_target});
  const Eigen::Vector3d outward = -UnitVector(scene_->task.insertion);
  return Serving(env::ToolInverseKinematics(*scene_, world_T_grasp * Eigen::Translation3d(kApproach_m * outward)),
                 [&](const env::JointVector& q) { return Approaches(q, world_T_grasp); });
}

std::string StageReach::Starts(const env::JointVector& q_rad, const Pose& world_T_target) {
  if (!roomy_.Free(q_rad)) return roomy_.Collision(q_rad) + " at the start pose";
  const Task& task = scene_->task;
  const auto at = [&](const Eigen::Vector3d& place) {
    return Follow(*scene_, q_rad, world_T_target * Eigen::Translation3d(place));
  };
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  const auto inserted = at((task.insertion_depth_m - kShort_m) * inward);
  if (!inserted) return "the end of the insertion is out of reach";
  if (!exact_.Free(*inserted)) return exact_.Collision(*inserted) + " at the end of the insertion";
  const int along = AxisOf(task.insertion);
  const int u = (along + 1) % 3;
  const int v = (along + 2) % 3;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d place = task.start_offset_m;
    place[u] += task.workspace_center_m[u] + ((corner & 1) != 0 ? task.workspace_m[u] : -task.workspace_m[u]);
    place[v] += task.workspace_center_m[v] + ((corner & 2) != 0 ? task.workspace_m[v] : -task.workspace_m[v]);
    // Down there the part itself may meet the target, so all of it is asked about half way to the mouth only.
    const double bottom =
        task.start_offset_m[along] + task.workspace_center_m[along] + inward[along] * task.workspace_m[along];
    if ((corner & 4) != 0) place[along] *= 0.5;
    const auto q = at(place);
    if (!q) return "a corner of the workspace of the task is out of reach";
    if (!exact_.Free(*q)) return exact_.Collision(*q) + " at a corner of the workspace of the task";
    if ((corner & 4) == 0) continue;
    place[along] = bottom;
    const auto below = at(place);
    if (!below) return "a corner of the workspace of the task is out of reach";
    const std::string touched = ArmCollision(*below, world_T_target);
    if (!touched.empty()) return touched + " at a lower corner of the workspace of the task";
  }
  const auto away = Follow(*scene_, *inserted,
                           world_T_target * Eigen::Translation3d((task.insertion_depth_m - kApproach_m) * inward));
  if (!away) return "the way of the empty gripper off the part is out of reach";
  if (!exact_.Free(*away)) return exact_.Collision(*away) + " on the way off the part";
  return "";
}

ServingBranches StageReach::AtStart(const Pose& world_T_target, const Pose& world_T_start) {
  roomy_.SetTargetPoses({world_T_target});
  exact_.SetTargetPoses({world_T_target});
  return Serving(env::ToolInverseKinematics(*scene_, world_T_start),
                 [&](const env::JointVector& q) { return Starts(q, world_T_target); });
}

planner::TransferPlan PlanToBranches(env::TransferChecker& checker, const env::Scene& scene,
                                     const env::JointVector& start_rad, const std::vector<env::JointVector>& branches,
                                     std::uint64_t seed) {
  env::TransferSettings settings;
  settings.seed = seed;
  settings.twin_margin_rad = kMostJointTurn_rad;  // room for the straight motions that follow
  return env::PlanTransfer(checker, scene, start_rad, branches, settings);
}

}  // namespace feeler::workflow
