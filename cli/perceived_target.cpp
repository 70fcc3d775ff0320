#include "feeler/cli/perceived_target.h"

#include <fmt/format.h>

#include <optional>
#include <vector>

#include "feeler/cli/common/console.h"
#include "feeler/core/error.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/task_file.h"
#include "feeler/perception/cloud_file.h"
#include "feeler/perception/depth_file.h"
#include "feeler/perception/input_file.h"
#include "feeler/policies/storage/database.h"
#include "feeler/workflow/perception/perceive_table.h"

namespace feeler::cli {

void AddTargetSources(CLI::App& command, TargetSources& sources) {
  command.add_option("--depth", sources.depth, "16-bit PNG of depths");
  command.add_option("--intrinsics", sources.intrinsics,
                     "JSON of the camera and where it stands (docs/file-formats.md); with --cloud: its points are in "
                     "the camera's frame");
  command.add_option("--background", sources.background, "depth image of the scene without the target");
  command.add_option("--cloud", sources.cloud, "PLY or PCD file, metres, in the base frame of the robot");
  command.add_option("--table", sources.table, "uncertainty table of the task (feeler perceive calibrate)");
}

void RequireSources(const std::string& task, const TargetSources& sources) {
  if (task.empty()) throw InputError("--task", "missing", "say which target to look for");
  if (sources.table.empty()) throw InputError("--table", "missing", "make one with feeler perceive calibrate");
  if (sources.depth.empty() == sources.cloud.empty()) {
    throw InputError("command line", "one of --depth and --cloud is needed",
                     "give --depth with --intrinsics, or --cloud");
  }
  if (!sources.depth.empty() && sources.intrinsics.empty()) {
    throw InputError("--intrinsics", "missing", "give the JSON of the camera that took the depth image");
  }
  if (!sources.background.empty() && sources.depth.empty()) {
    throw InputError("--background", "needs a depth image", "give --depth as well");
  }
}

perception::Registration Locate(const TargetSources& sources, const workflow::TargetFinder& finder,
                                const perception::UncertaintyTable& table, const Eigen::Vector3d& expected_m) {
  std::optional<perception::CameraIntrinsics> camera;
  if (!sources.intrinsics.empty()) {
    camera = perception::ParseIntrinsics(perception::ReadFile(sources.intrinsics), sources.intrinsics);
  }
  if (!sources.cloud.empty()) {
    std::vector<std::string> notes;
    perception::Points points = perception::ReadCloud(sources.cloud, &notes);
    for (const std::string& note : notes) Note("{}\n", note);
    if (!camera) return finder.InCloud(points, table.camera_m);
    for (Eigen::Vector3d& p : points) p = camera->world_T_camera * p;
    return finder.InCloud(points, camera->world_T_camera.translation());
  }
  const perception::DepthFrame depth =
      perception::ParseDepthPng(perception::ReadFile(sources.depth), *camera, sources.depth);
  std::optional<perception::DepthFrame> background;
  if (!sources.background.empty()) {
    background = perception::ParseDepthPng(perception::ReadFile(sources.background), *camera, sources.background);
  }
  perception::Registration found = finder.InDepth(depth, *camera, background ? &*background : nullptr);
  if (!found.found) found.reason += perception::GuessDepthUnit(depth, *camera, expected_m);
  return found;
}

PerceivedTarget FindTarget(const std::string& task, const std::string& db, const TargetSources& sources) {
  RequireSources(task, sources);
  const env::TaskModel model = env::LoadTask(task);
  const perception::UncertaintyTable table =
      workflow::LoadTable(sources.table, model.task, env::Fingerprint(model, env::Opening::kClosed));
  planner::ProblemFamily family = workflow::FamilyOfTable(table, model.task, sources.table);
  if (!db.empty()) {
    policies::Database database = policies::Database::OpenReadOnly(db);
    family.problems.clear();
    for (const policies::StoredProblem& problem : database.List()) family.problems.push_back(problem.extents);
  }
  const workflow::TargetFinder finder(model, workflow::SettingsOf(table));
  const perception::Registration found = Locate(sources, finder, table, model.task.world_T_target.translation());
  if (!found.found) throw NegativeResult(sources.depth + sources.cloud, "target not found: " + found.reason);
  const perception::PoseHypotheses hypotheses = perception::HypothesesFor(table, found.world_T_target);
  const auto extents = workflow::SnapTo(family, model.task, hypotheses.counts);
  if (!extents) throw NegativeResult(db, "holds no problem large enough for this estimate");
  const Eigen::Vector3d& p = hypotheses.world_T_estimate.translation();
  const Eigen::Quaterniond q(hypotheses.world_T_estimate.linear());
  return {fmt::format("{:.9f},{:.9f},{:.9f},{:.12f},{:.12f},{:.12f},{:.12f}", p.x(), p.y(), p.z(), q.w(), q.x(), q.y(),
                      q.z()),
          planner::ToString(*extents), static_cast<std::int64_t>(extents->Count())};
}

}  // namespace feeler::cli
