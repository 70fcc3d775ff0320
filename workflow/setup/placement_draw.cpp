#include "feeler/workflow/setup/placement_draw.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/robot/tool_kinematics.h"

namespace feeler::workflow {
namespace {

constexpr int kMostDraws = 100000;
/// How far any joint may turn between the start pose and the places around it; a branch that has to turn farther is
/// near a singularity, where guarded moves crawl.
constexpr double kMostJointTurn_rad = 0.8;

/// Where a target is put that is to be left out of a check.
constexpr double kOutOfTheWay_m = 10.0;

/// Of two geoms of the model, placed as in `data`.
bool Overlap(const mjModel& model, mjData& data, int first, int second) {
  if (model.geom_type[first] > model.geom_type[second]) std::swap(first, second);
  const mjfCollision collide = mjCOLLISIONFUNC[model.geom_type[first]][model.geom_type[second]];
  if (collide == nullptr) return false;
  std::array<mjContact, mjMAXCONPAIR> contacts;
  const int count = collide(&model, &data, contacts.data(), first, second, 0.0);
  return std::any_of(contacts.begin(), contacts.begin() + count, [](const mjContact& c) { return c.dist < 0.0; });
}

}  // namespace

std::string_view ToString(Placement placement) { return placement == Placement::kNominal ? "nominal" : "workspace"; }

Placement ParsePlacement(std::string_view text) {
  for (const Placement placement : {Placement::kNominal, Placement::kWorkspace}) {
    if (text == ToString(placement)) return placement;
  }
  throw InputError("placement", fmt::format("no placement is named '{}'", text), "one of nominal, workspace");
}

PlacementSampler::PlacementSampler(std::shared_ptr<const env::Scene> scene, const Workspace& workspace)
    : scene_(std::move(scene)),
      workspace_(workspace),
      roomy_(*scene_),
      exact_(*scene_, 0.0),
      without_target_(*scene_),
      data_(env::MakeData(*scene_->model)) {
  if (!(workspace.lower_m.array() <= workspace.upper_m.array()).all() || !(workspace.yaw_rad >= 0.0)) {
    throw InputError("workspace", "its lower bounds lie above the upper", "swap them");
  }
  env::ResetScene(*scene_, scene_->home_q_rad, *data_);
  without_target_.SetTargetPoses({Eigen::Translation3d(0.0, 0.0, kOutOfTheWay_m) * scene_->task.world_T_target});
  for (const UncertainAxis& axis : scene_->task.axes) largest_.push_back(axis.max_cells);
}

PlacementDraw PlacementSampler::Draw(RandomStream& random, const std::function<bool(const Pose&)>& accept) {
  const Pose& nominal = scene_->task.world_T_target;
  PlacementDraw draw;
  for (; draw.rejected < kMostDraws; ++draw.rejected) {
    Eigen::Vector3d position;
    for (int axis = 0; axis < 3; ++axis) {
      position[axis] = random.Uniform(workspace_.lower_m[axis], workspace_.upper_m[axis]);
    }
    const double yaw = random.Uniform(-workspace_.yaw_rad, workspace_.yaw_rad);
    draw.world_T_target = MakePose(position, yaw);
    draw.world_T_target.linear() = draw.world_T_target.linear() * nominal.linear();
    if (Obstacle(draw.world_T_target).empty() && (!accept || accept(draw.world_T_target))) return draw;
  }
  throw InputError("placement", fmt::format("none of {} drawn poses of the target can be served", kMostDraws),
                   "make the workspace larger or move it into reach");
}

std::string PlacementSampler::Obstacle(const Pose& world_T_target) {
  const std::vector<env::JointVector> branches =
      env::ToolInverseKinematics(*scene_, env::NominalStartPose(scene_->task, world_T_target));
  if (branches.empty()) return "the start pose is out of reach";
  if (!TargetIsFree(world_T_target)) return "the target overlaps a fixture";
  // Transfers keep clear of the whole box of hypotheses, which may be any up to the largest.
  const std::vector<Pose> largest_box = env::TargetCandidates(scene_->task, world_T_target, largest_);
  roomy_.SetTargetPoses(largest_box);
  if (!roomy_.Free(scene_->home_q_rad)) return "the target overlaps the arm at home";
  if (std::none_of(branches.begin(), branches.end(), [&](const env::JointVector& q) { return roomy_.Free(q); })) {
    return "the arm or its tool is in collision at the start pose";
  }
  // A transfer may end in any branch that is free for a small box.
  roomy_.SetTargetPoses({world_T_target});
  for (const env::JointVector& start : branches) {
    if (roomy_.Free(start) && !BranchServes(start, world_T_target)) return "a branch of the arm cannot make the moves";
  }
  return "";
}

bool PlacementSampler::TargetIsFree(const Pose& world_T_target) {
  const mjModel& model = *scene_->model;
  env::SetTargetPose(*scene_, world_T_target, *data_);
  mj_kinematics(&model, data_.get());
  return std::none_of(scene_->target_geoms.begin(), scene_->target_geoms.end(), [&](int target) {
    return std::any_of(scene_->environment_geoms.begin(), scene_->environment_geoms.end(),
                       [&](int fixture) { return Overlap(model, *data_, target, fixture); });
  });
}

bool PlacementSampler::BranchServes(const env::JointVector& start_rad, const Pose& world_T_target) {
  const Task& task = scene_->task;
  const auto reach = [&](const Eigen::Vector3d& target_p_tool) {
    env::JointVector q = start_rad;
    const Pose tool = world_T_target * Eigen::Translation3d(target_p_tool);
    return env::SolveNearby(*scene_, tool, q, kMostJointTurn_rad) ? std::optional(q) : std::nullopt;
  };
  // A hair short of the end, where the tool may stand on the floor of the opening.
  constexpr double kShort_m = 5e-4;
  const Eigen::Translation3d inserted((task.insertion_depth_m - kShort_m) * UnitVector(task.insertion));
  for (const Pose& target : env::TargetCandidates(task, world_T_target, largest_)) {
    exact_.SetTargetPoses({target});
    env::JointVector q = start_rad;
    if (!env::SolveNearby(*scene_, target * inserted, q, kMostJointTurn_rad)) return false;
    if (!exact_.Free(q) || !without_target_.Free(q)) return false;
  }
  exact_.SetTargetPoses({world_T_target});
  const int along = AxisOf(task.insertion);
  const int u = (along + 1) % 3;
  const int v = (along + 2) % 3;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d place = task.start_offset_m;
    place[u] += (corner & 1) != 0 ? task.workspace_m[u] : -task.workspace_m[u];
    place[v] += (corner & 2) != 0 ? task.workspace_m[v] : -task.workspace_m[v];
    // Down there the tool itself may meet the target, so the arm is asked about half way to the mouth.
    if ((corner & 4) != 0) place[along] *= 0.5;
    const auto q = reach(place);
    if (!q || !exact_.Free(*q)) return false;
  }
  // Touches go as deep as the inserted tool: beside the target they must not meet the bench, which no policy knows.
  bool clear = true;
  for (int corner = 0; corner < 4 && clear; ++corner) {
    Eigen::Vector3d place = task.insertion_depth_m * UnitVector(task.insertion);
    place[u] += (corner & 1) != 0 ? task.workspace_m[u] : -task.workspace_m[u];
    place[v] += (corner & 2) != 0 ? task.workspace_m[v] : -task.workspace_m[v];
    const auto q = reach(place);
    clear = q && without_target_.Free(*q);
  }
  return clear;
}

}  // namespace feeler::workflow
