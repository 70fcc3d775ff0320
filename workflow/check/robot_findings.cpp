#include "feeler/workflow/check/robot_findings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/robot/transfer_checker.h"
#include "feeler/env/scene/gripper.h"
#include "feeler/env/scene/scene.h"

namespace feeler::workflow {
namespace {

using env::TaskFinding;

constexpr double kReach_m = 1.3;  ///< of the UR10e, from its shoulder

std::string Numeric(const std::string& where, const char* field) {
  return fmt::format("{}: <custom><numeric name=\"{}\">", where, field);
}

void AddReach(const env::Scene& scene, const std::vector<int>& extents, const std::string& where,
              env::TaskFindings& findings) {
  const Task& task = scene.task;
  const Eigen::Vector3d shoulder(0, 0, env::Ur10eGeometry::kD1_m);
  const auto check = [&](const Pose& world_T_tool, const char* what) {
    if (!env::ToolInverseKinematics(scene, world_T_tool).empty()) return true;
    const double distance_m = ((world_T_tool * scene.flange_T_tool.inverse()).translation() - shoulder).norm();
    findings.push_back(
        {TaskFinding::Severity::kError, "reach", fmt::format("{}: <body name=\"target\">", where),
         fmt::format("{} is out of the robot's reach: the flange would be {:.3f} m from the shoulder, the "
                     "arm reaches {} m{}",
                     what, distance_m, kReach_m, distance_m < 0.3 ? " and not its own base" : ""),
         distance_m > kReach_m ? fmt::format("move the target {:.2f} m nearer to the base", distance_m - kReach_m + 0.1)
                               : "move the target in front of the robot, 0.4 to 1 m from its base"});
    return false;
  };
  const Pose start = env::NominalStartPose(task, task.world_T_target);
  if (!check(start, "the start pose")) return;
  for (const Pose& target : env::TargetCandidates(task, task.world_T_target, extents)) {
    Pose inserted = target;
    inserted.translation() += target.linear() * (task.insertion_depth_m * UnitVector(task.insertion));
    if (!check(inserted, "the inserted pose")) return;
  }
}

/// Whether some branch of the inverse kinematics stands clear of every place of the target at the start; else what is
/// in the way of the first.
bool StandsClear(const env::Scene& scene, env::TransferChecker& checker, const Eigen::Vector3d& start_offset_m,
                 std::string& collision) {
  Task task = scene.task;
  task.start_offset_m = start_offset_m;
  const auto branches = env::ToolInverseKinematics(scene, env::NominalStartPose(task, task.world_T_target));
  for (const env::JointVector& q : branches) {
    if (checker.Free(q)) return true;
    if (collision.empty()) collision = checker.Collision(q);
  }
  return branches.empty();  // said as out of reach
}

void AddStart(const env::Scene& scene, const std::vector<int>& extents, const std::string& where,
              env::TaskFindings& findings) {
  const Task& task = scene.task;
  env::TransferChecker checker(scene);
  checker.SetTargetPoses(env::TargetCandidates(task, task.world_T_target, extents));
  std::string collision;
  if (StandsClear(scene, checker, task.start_offset_m, collision)) return;
  std::string mend = "start further from the target, or move what is in the way";
  for (int step = 1; step <= 40; ++step) {
    const double more_m = 0.001 * step;
    const Eigen::Vector3d start_m = task.start_offset_m - more_m * UnitVector(task.insertion);
    std::string other;
    if (!StandsClear(scene, checker, start_m, other)) continue;
    mend = fmt::format(
        "start {:.0f} mm further out: \"{:.4g} {:.4g} {:.4g}\" (and move feeler_workspace_center, or widen "
        "feeler_workspace, by as much)",
        more_m * 1000, start_m.x(), start_m.y(), start_m.z());
    break;
  }
  findings.push_back(
      {TaskFinding::Severity::kError, "start-clearance", Numeric(where, "feeler_start_offset"),
       fmt::format("no transfer may end at the start: it keeps {:.3g} mm clear of every place of the target "
                   "in the box of {} hypotheses, and there {} are nearer",
                   checker.clearance_m() * 1000, fmt::join(extents, "x"), collision),
       mend});
}

}  // namespace

env::TaskFindings RobotFindings(const env::TaskModel& task_model, const std::vector<int>& extents,
                                const std::string& where) {
  const env::GripperFit fit =
      env::FitGripper(*task_model.model, task_model.tool_geoms, task_model.tool_body, task_model.task.flange_T_tool);
  env::TaskFindings findings =
      env::HoldFindings(fit, task_model.task, task_model.model->body_subtreemass[task_model.tool_body], where);
  for (const TaskFinding& finding : findings) {
    if (finding.severity == TaskFinding::Severity::kError) return findings;  // no arm holds it: nothing else to ask
  }
  const env::Scene scene = env::BuildScene(task_model);
  const std::size_t before = findings.size();
  AddReach(scene, extents, where, findings);
  if (findings.size() == before) AddStart(scene, extents, where, findings);
  return findings;
}

}  // namespace feeler::workflow
