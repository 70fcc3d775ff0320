#include "feeler/workflow/assembly/assembly_check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <memory>
#include <numbers>

#include "feeler/core/error.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/workflow/assembly/assembly_mating.h"
#include "feeler/workflow/assembly/assembly_reach.h"
#include "feeler/workflow/assembly/assembly_stage.h"

namespace feeler::workflow {
namespace {

constexpr double kQuarter = 0.5 * std::numbers::pi;

/// "mast" of "part mast".
std::string Bare(const std::string& name) { return name.starts_with("part ") ? name.substr(5) : name; }

std::string Say(const PartOverlap& overlap) {
  return fmt::format("{} and {} overlap by {:.1f} mm", Bare(overlap.first), Bare(overlap.second),
                     1e3 * overlap.depth_m);
}

/// The port as drawn, and turned as far as the task allows along each angle.
std::vector<Pose> Turned(const env::TaskModel& model, const Pose& world_T_target) {
  std::vector<Pose> poses{world_T_target};
  for (const UncertainAxis& axis : model.task.axes) {
    if (!axis.angular()) continue;
    const Eigen::Vector3d about =
        axis.kind == AxisKind::kYaw ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d(Eigen::Vector3d::UnitY());
    for (const double side : {-0.5, 0.5}) {
      const double angle_rad = side * (axis.max_cells - 1) * axis.resolution;
      poses.push_back(world_T_target * Eigen::AngleAxisd(angle_rad, about));
    }
  }
  return poses;
}

class Checker {
 public:
  explicit Checker(const Assembly& assembly)
      : assembly_(assembly), mating_(assembly), nominal_(NominalPoses(assembly)) {
    for (const AssemblyPart& part : assembly.parts) poses_.push_back(part.world_T_part);
  }

  AssemblyPlan Run(const ProgressCallback& progress) {
    const auto total = static_cast<std::int64_t>(assembly_.insertions.size());
    CheckStart();
    AssemblyPlan plan;
    for (std::size_t i = 0; i < assembly_.insertions.size(); ++i) {
      plan.grip_turn_rad.push_back(CheckInsertion(i));
      if (progress) progress(static_cast<std::int64_t>(i) + 1, total);
    }
    plan.world_T_part = nominal_;
    return plan;
  }

 private:
  [[noreturn]] void Fail(const std::string& where, const std::string& what, const std::string& mend) const {
    throw InputError(assembly_.file + ": " + where, what, mend);
  }

  env::Scene Stage(std::size_t insertion, StagePhase phase, double grip_turn_rad = 0.0) const {
    return BuildStage(assembly_, {insertion, phase, grip_turn_rad, poses_});
  }

  void CheckStart() const {
    const env::Scene scene = Stage(0, StagePhase::kFetch);
    const std::vector<PartOverlap> overlaps = FindOverlaps(scene, scene.home_q_rad);
    if (overlaps.empty()) return;
    Fail("parts", "at the start " + Say(overlaps.front()), "move them apart (position_m, yaw_deg)");
  }

  double CheckInsertion(std::size_t i) {
    const AssemblyInsertion& step = assembly_.insertions[i];
    const std::string where = assembly_.Describe(i);
    {
      const env::Scene scene = Stage(i, StagePhase::kInsert);
      const std::string difference = mating_.Difference(scene, i);
      if (!difference.empty())
        Fail(where, difference, "turn the part, change the order, or keep its surroundings free");
    }
    std::string obstacle;
    std::optional<double> grip;
    for (const double turn : {0.0, kQuarter, -kQuarter, 2.0 * kQuarter}) {
      const std::string found = Obstacle(i, turn);
      if (found.empty()) {
        grip = turn;
        break;
      }
      if (obstacle.empty()) obstacle = found;
    }
    if (!grip) Fail(where, obstacle, "move or turn the part or what it goes into");

    poses_[static_cast<std::size_t>(step.part)] = nominal_[static_cast<std::size_t>(step.part)];
    const env::Scene after = Stage(i, StagePhase::kFetch);
    for (const PartOverlap& overlap : FindOverlaps(after, after.home_q_rad)) {
      Fail(where, "once built " + Say(overlap), "move or turn them");
    }
    return *grip;
  }

  /// Why the arm cannot do an insertion with the part turned so in its gripper; empty if it can.
  std::string Obstacle(std::size_t i, double grip_turn_rad) const {
    const AssemblyInsertion& step = assembly_.insertions[i];
    const Pose grasp = GraspPose(assembly_, i, poses_);
    StageReach fetch(std::make_shared<const env::Scene>(Stage(i, StagePhase::kFetch, grip_turn_rad)));
    const ServingBranches to_part = fetch.AtApproach(grasp);
    if (!to_part.obstacle.empty()) return "fetching: " + to_part.obstacle;
    const auto scene = std::make_shared<const env::Scene>(Stage(i, StagePhase::kInsert, grip_turn_rad));
    StageReach insert(scene);
    const ServingBranches off = insert.AtApproach(grasp);
    if (!off.obstacle.empty()) return "lifting: " + off.obstacle;
    for (const Pose& target : Turned(*assembly_.tasks.at(step.task), scene->task.world_T_target)) {
      const ServingBranches start = insert.AtStart(target, env::NominalStartPose(scene->task, target));
      if (!start.obstacle.empty()) return "inserting: " + start.obstacle;
    }
    return "";
  }

  const Assembly& assembly_;
  MatingCheck mating_;
  std::vector<Pose> nominal_;
  std::vector<Pose> poses_;  ///< as built so far
};

}  // namespace

AssemblyPlan CheckAssembly(const Assembly& assembly, const ProgressCallback& progress) {
  return Checker(assembly).Run(progress);
}

}  // namespace feeler::workflow
