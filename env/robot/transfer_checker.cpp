#include "feeler/env/robot/transfer_checker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

constexpr double kLargestClearance_m = 0.015;

// For every joint: over all geoms that it moves, the longest chain of body offsets from the joint to the geom plus the
// geom's bounding radius. A point can be no farther from the joint than that, however the joints stand.
JointVector Reach(const Scene& scene) {
  const mjModel& model = *scene.model;
  JointVector reach = JointVector::Zero();
  for (int geom = 0; geom < model.ngeom; ++geom) {
    const ScenePart part = scene.geom_part[static_cast<std::size_t>(geom)];
    if (part != ScenePart::kRobot && part != ScenePart::kTool) continue;
    double distance = model.geom_rbound[geom] + Eigen::Map<const Eigen::Vector3d>(model.geom_pos + 3 * geom).norm();
    for (int body = model.geom_bodyid[geom]; body > 0; body = model.body_parentid[body]) {
      for (int i = 0; i < kJointCount; ++i) {
        if (model.jnt_bodyid[scene.joint[static_cast<std::size_t>(i)]] == body) {
          reach[i] = std::max(reach[i], distance);
        }
      }
      distance += Eigen::Map<const Eigen::Vector3d>(model.body_pos + 3 * body).norm();
    }
  }
  return reach;
}

}  // namespace

planner::JointBounds JointLimits(const Scene& scene) {
  planner::JointBounds limits{JointVector::Zero(), JointVector::Zero()};
  for (int i = 0; i < kJointCount; ++i) {
    const double* range = scene.model->jnt_range + 2 * scene.joint[static_cast<std::size_t>(i)];
    limits.lower_rad[i] = range[0];
    limits.upper_rad[i] = range[1];
  }
  return limits;
}

JointVector NearestTwin(const JointVector& q_rad, const JointVector& start_rad, const planner::JointBounds& bounds,
                        double margin_rad) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  JointVector twin = q_rad;
  for (int i = 0; i < kJointCount; ++i) {
    for (const double other : {q_rad[i] - kTurn, q_rad[i] + kTurn}) {
      const bool allowed = other >= bounds.lower_rad[i] + margin_rad && other <= bounds.upper_rad[i] - margin_rad;
      if (allowed && std::abs(other - start_rad[i]) < std::abs(twin[i] - start_rad[i])) twin[i] = other;
    }
  }
  return twin;
}

std::string NameOfGeom(const mjModel& model, int geom) {
  const char* name = mj_id2name(&model, mjOBJ_GEOM, geom);
  if (name == nullptr) name = mj_id2name(&model, mjOBJ_BODY, model.geom_bodyid[geom]);
  return name == nullptr ? "unnamed geom" : name;
}

TransferChecker::TransferChecker(const Scene& scene, double clearance_m)
    : scene_(scene), targets_{scene.task.world_T_target}, clearance_m_(clearance_m), reach_m_(Reach(scene)) {
  if (!(clearance_m >= 0.0 && clearance_m <= kLargestClearance_m)) {
    throw InputError("transfer", fmt::format("clearance {} m out of range", clearance_m), "0 to 0.015 m");
  }
  ModelHandle model(mj_copyModel(nullptr, scene.model.get()));
  if (!model) throw WorldError("MuJoCo", "no memory for the model");
  std::fill(model->geom_margin, model->geom_margin + model->ngeom, clearance_m);
  model_ = std::shared_ptr<const mjModel>(model.release(), ModelDeleter());
  data_ = MakeData(*model_);
}

TransferChecker::TransferChecker(const TransferChecker& other)
    : scene_(other.scene_),
      model_(other.model_),
      data_(MakeData(*other.model_)),
      targets_(other.targets_),
      clearance_m_(other.clearance_m_),
      reach_m_(other.reach_m_) {}

void TransferChecker::SetTargetPoses(std::vector<Pose> world_T_target) {
  if (world_T_target.empty()) throw InputError("transfer", "no pose of the target", "give at least one");
  targets_ = std::move(world_T_target);
}

bool TransferChecker::Free(const JointVector& q_rad) {
  SetJointPositions(scene_, q_rad, *data_);
  for (const Pose& target : targets_) {
    SetTargetPose(scene_, target, *data_);
    mj_kinematics(model_.get(), data_.get());
    mj_collision(model_.get(), data_.get());
    if (data_->ncon > 0) {
      TakeMujocoWarning();  // a full contact buffer is as good an answer as one contact
      return false;
    }
  }
  return true;
}

std::string TransferChecker::Collision(const JointVector& q_rad) {
  if (Free(q_rad)) return "";
  const mjContact& contact = data_->contact[0];
  return NameOfGeom(*model_, contact.geom1) + " and " + NameOfGeom(*model_, contact.geom2);
}

planner::TransferPlan PlanTransfer(TransferChecker& checker, const Scene& scene, const JointVector& start_rad,
                                   const std::vector<JointVector>& goals_rad, const TransferSettings& settings) {
  planner::TransferOptions options = settings.search;
  options.seed = settings.seed;
  options.reach_m = checker.reach_m();
  options.most_checks = settings.most_checks;
  // Half the spacing stays within the clearance, and so does half of it again for rounded corners.
  options.check_spacing_m = std::max(checker.clearance_m(), 0.001);
  const planner::JointBounds limits = JointLimits(scene);
  planner::JointBounds bounds;
  const JointVector near = JointVector::Constant(settings.joint_bound_rad);
  bounds.lower_rad = JointVector(-near).cwiseMin(start_rad).cwiseMax(limits.lower_rad);
  bounds.upper_rad = near.cwiseMax(start_rad).cwiseMin(limits.upper_rad);
  const planner::ValidityFunction free = [&](const Eigen::VectorXd& q) { return checker.Free(q); };
  const planner::TransferPlanner planner(bounds, free, options);
  std::vector<Eigen::VectorXd> goals(goals_rad.begin(), goals_rad.end());
  std::vector<int> goal_of(goals_rad.size());  // of those that are added
  std::iota(goal_of.begin(), goal_of.end(), 0);
  const auto add_twins = [&](const planner::JointBounds& within) {
    for (std::size_t i = 0; i < goals_rad.size(); ++i) {
      const JointVector twin = NearestTwin(goals_rad[i], start_rad, within, settings.twin_margin_rad);
      if (std::ranges::find(goals, Eigen::VectorXd(twin)) != goals.end()) continue;
      goals.emplace_back(twin);
      goal_of.push_back(static_cast<int>(i));
    }
  };
  add_twins(bounds);
  planner::TransferPlan plan = planner.Plan(start_rad, goals);
  if (plan.status == planner::TransferStatus::kNotFound && settings.far_iterations > 0) {
    add_twins(limits);
    options.iterations_all_goals = settings.far_iterations;
    const int checks = plan.checks;
    if (settings.most_checks > 0) options.most_checks = std::max(1, settings.most_checks - checks);
    plan = planner::TransferPlanner(limits, free, options).Plan(start_rad, goals);
    plan.checks += checks;
  }
  if (plan.goal >= 0) plan.goal = goal_of[static_cast<std::size_t>(plan.goal)];
  if (plan.status == planner::TransferStatus::kStartInvalid && planner.WithinBounds(start_rad)) {
    plan.reason += ": " + checker.Collision(start_rad);
  } else if (plan.status == planner::TransferStatus::kNoGoal && !goals.empty()) {
    plan.reason += ": " + checker.Collision(goals_rad.front());
  }
  return plan;
}

planner::TransferPlan PlanTransfer(TransferChecker& checker, const Scene& scene, const JointVector& start_rad,
                                   const Pose& world_T_tool, const TransferSettings& settings) {
  return PlanTransfer(checker, scene, start_rad, ToolInverseKinematics(scene, world_T_tool), settings);
}

}  // namespace feeler::env
