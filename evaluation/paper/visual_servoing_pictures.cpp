#include "feeler/evaluation/paper/visual_servoing_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "feeler/core/error.h"
#include "feeler/env/vision/image.h"
#include "feeler/env/vision/wrist_camera.h"
#include "feeler/policies/visual/visual_servoing_features.h"
#include "feeler/workflow/setup/visual_goal.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;
using Color = std::array<std::uint8_t, 3>;

constexpr Color kSeen = {70, 235, 120};
constexpr Color kGoal = {255, 200, 40};

void Dot(const Eigen::Vector2d& at, int radius, const Color& color, env::Image& image) {
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      const auto column = static_cast<int>(std::lround(at.x())) + dx;
      const auto row = static_cast<int>(std::lround(at.y())) + dy;
      if (dx * dx + dy * dy > radius * radius || column < 0 || row < 0 || column >= image.width ||
          row >= image.height) {
        continue;
      }
      const auto pixel =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(column);
      std::copy(color.begin(), color.end(), image.rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
    }
  }
}

void Stroke(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Color& color, env::Image& image) {
  const int steps = std::max(1, static_cast<int>((to - from).norm()));
  for (int i = 0; i <= steps; ++i) Dot(from + (to - from) * i / steps, 0, color, image);
}

env::Image ImageOf(const CameraView& view) { return {view.width, view.height, view.rgb}; }

/// The view from the start pose of an episode over a target that is a centimetre beside its nominal place.
CameraView StartView(const std::shared_ptr<const env::Scene>& scene) {
  const Task& task = scene->task;
  constexpr double kBeside_m = 0.01;
  constexpr double kHalfUncertainty_m = 0.014;
  const Pose start = task.world_T_target * Eigen::Translation3d(task.start_offset_m) *
                     Eigen::Translation3d(-kHalfUncertainty_m * UnitVector(task.insertion));
  const std::vector<env::JointVector> branches = env::ToolInverseKinematics(*scene, start);
  if (branches.empty()) throw InputError("pictures", "the start pose is out of reach", "move the target");
  const auto nearest = std::min_element(branches.begin(), branches.end(), [&](const auto& a, const auto& b) {
    return (a - scene->home_q_rad).norm() < (b - scene->home_q_rad).norm();
  });
  const env::DataHandle data = env::MakeData(*scene->model);
  env::ResetScene(*scene, *nearest, *data);
  env::SetTargetPose(*scene, task.world_T_target * Eigen::Translation3d(kBeside_m, -kBeside_m, 0.0), *data);
  mj_forward(scene->model.get(), data.get());
  env::WristCamera camera(scene);
  RandomStream noise(1, 0, "image");
  return camera.Look(*data, &noise);
}

}  // namespace

std::vector<json> WriteVisualServoingPictures(const VisualServoingRow& row, const ExperimentRequest& request) {
  const auto scene = std::make_shared<const env::Scene>(env::BuildScene(env::LoadTask(row.setting.task)));
  const std::shared_ptr<const policies::VisualGoal> goal = workflow::TeachVisualGoal(scene);
  const bool tape = row.features != "SIFT";
  const auto tracker = tape ? policies::MakeTapeTracker(goal) : policies::MakeSiftTracker(goal);
  const CameraView start = StartView(scene);
  const policies::FeatureMatches found = tracker->Match(start);
  env::Image seen = ImageOf(start);
  for (const policies::FeatureMatch& match : found.matches) {
    Stroke(match.seen_px, match.goal_px, kGoal, seen);
    Dot(match.goal_px, 2, kGoal, seen);
    Dot(match.seen_px, 3, kSeen, seen);
  }
  const std::string folder = std::string(kVisualServoingName) + "/";
  const std::string stem = row.setting.task + (tape ? "-tape" : "-sift");
  std::error_code error;
  std::filesystem::create_directories(request.out + "/" + folder, error);
  if (error)
    throw InputError(request.out + "/" + folder, "cannot be created: " + error.message(),
                     "choose a folder where you may write");
  env::WritePng(ImageOf(goal->view), request.out + "/" + folder + stem + "-goal.png");
  env::WritePng(seen, request.out + "/" + folder + stem + "-start.png");
  const std::string what = fmt::format("{}, {}", row.scene, row.features);
  return {
      {{"file", folder + stem + "-goal.png"},
       {"caption", fmt::format("{}: the goal as taught; the plug hides most of the opening; {} features", what,
                               tracker->goal_features())}},
      {{"file", folder + stem + "-start.png"},
       {"caption", found.matches.empty()
                       ? fmt::format("{}: from a start pose; {}", what, found.lost)
                       : fmt::format("{}: from a start pose; {} features (green) and where they have to go (yellow)",
                                     what, found.matches.size())}}};
}

}  // namespace feeler::evaluation
