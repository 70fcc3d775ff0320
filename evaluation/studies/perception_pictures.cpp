#include "feeler/evaluation/studies/perception_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>

#include "feeler/core/random.h"
#include "feeler/env/vision/image.h"
#include "feeler/env/vision/renderer.h"

namespace feeler::evaluation {
namespace {

using Color = std::array<std::uint8_t, 3>;
constexpr Color kMeasured = {90, 100, 110};
constexpr Color kModel = {0, 130, 200};
constexpr Color kBox = {220, 90, 20};
constexpr Color kTruth = {20, 140, 60};

/// A white picture of `side` pixels that shows `width_m` of a plane.
class Plot {
 public:
  Plot(int side, double width_m, std::function<Eigen::Vector2d(const Eigen::Vector3d&)> project)
      : image_{side, side,
               std::vector<std::uint8_t>(3 * static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 255)},
        scale_(side / width_m),
        project_(std::move(project)) {}

  void Dot(const Eigen::Vector3d& point, int size, const Color& color) {
    const Eigen::Vector2d at = project_(point) * scale_;
    const int u = static_cast<int>(std::lround(at.x() + 0.5 * image_.width));
    const int v = static_cast<int>(std::lround(0.5 * image_.height - at.y()));
    for (int row = std::max(0, v - size); row <= std::min(image_.height - 1, v + size); ++row) {
      for (int column = std::max(0, u - size); column <= std::min(image_.width - 1, u + size); ++column) {
        const std::size_t first = 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(image_.width) +
                                       static_cast<std::size_t>(column));
        std::copy(color.begin(), color.end(), image_.rgb.begin() + static_cast<std::ptrdiff_t>(first));
      }
    }
  }
  void Line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Color& color) {
    constexpr int kSteps = 600;
    for (int i = 0; i <= kSteps; ++i) Dot(from + (to - from) * (static_cast<double>(i) / kSteps), 1, color);
  }
  const env::Image& image() const { return image_; }

 private:
  env::Image image_;
  double scale_;
  std::function<Eigen::Vector2d(const Eigen::Vector3d&)> project_;
};

void DrawBox(const Pose& centre, const Eigen::Vector3d& half, Plot& plot) {
  const auto corner = [&](int k) {
    return Eigen::Vector3d(centre * half.cwiseProduct(Eigen::Vector3d((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1,
                                                                      (k & 4) != 0 ? 1 : -1)));
  };
  for (int k = 0; k < 8; ++k) {
    for (const int bit : {1, 2, 4}) {
      if ((k & bit) == 0) plot.Line(corner(k), corner(k | bit), kBox);
    }
  }
}

Eigen::Vector3d HalfBox(const Task& task, const std::vector<int>& counts) {
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < task.axes.size(); ++i) {
    const UncertainAxis& axis = task.axes[i];
    if (!axis.angular()) half[static_cast<int>(axis.kind)] = 0.5 * counts[i] * axis.resolution;
  }
  return half;
}

}  // namespace

nlohmann::json DrawPerception(const env::TaskModel& task_model, const workflow::Calibration& calibration,
                              const workflow::CalibrationOptions& options, const std::string& folder) {
  const auto shown = std::find_if(calibration.samples.begin(), calibration.samples.end(),
                                  [](const workflow::CalibrationSample& s) { return s.held_out && s.found; });
  nlohmann::json pictures = nlohmann::json::array();
  if (shown == calibration.samples.end()) return pictures;
  const auto save = [&](const env::Image& image, const char* name, std::string caption) {
    env::WritePng(image, folder + "/" + name);
    pictures.push_back({{"file", name}, {"caption", std::move(caption)}});
  };

  const auto scene = std::make_shared<const env::Scene>(env::BuildScene(task_model));
  const auto finder = std::make_shared<const workflow::TargetFinder>(task_model, options.perception);
  const Pose& truth = shown->poses.world_T_true;
  {
    const env::DataHandle data = env::MakeData(*scene->model);
    const env::DataHandle drawn = env::MakeData(*scene->drawn_model);
    env::ResetScene(*scene, scene->home_q_rad, *data);
    env::SetTargetPose(*scene, truth, *data);
    mj_kinematics(scene->model.get(), data.get());
    env::CopyForDrawing(*scene, *data, *drawn);
    env::RendererOptions renderer_options;
    renderer_options.width = 640;
    renderer_options.height = 576;
    env::Renderer renderer(scene->drawn_model, renderer_options);
    save(renderer.Color(*drawn, env::NamedCamera{env::kStaticCamera}), "perception-view.png",
         "What the depth camera looks at: the arm at home, the target at a drawn place.");
  }

  workflow::CameraCell cell(scene, finder, options.noise);
  RandomStream noise(options.seed, static_cast<std::uint64_t>(shown->index), "calibration picture");
  const workflow::Sight sight = cell.Look(truth, options.seed, static_cast<std::uint64_t>(shown->installation), noise);
  const perception::Points points = finder->Foreground(cell.depth(), cell.intrinsics(), &cell.background());
  const Pose& registered = sight.registration.world_T_target;
  const perception::PoseHypotheses hypotheses = perception::HypothesesFor(calibration.table, registered);
  const Eigen::Vector3d half = HalfBox(task_model.task, hypotheses.counts);

  const Eigen::Matrix3d view = perception::ViewAxes(cell.eye_m(), truth.translation());
  constexpr int kSide = 640;
  Plot cloud(kSide, 0.5, [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
    const Eigen::Vector3d q = view.transpose() * (p - truth.translation());
    return {q.y(), q.z()};
  });
  for (const Eigen::Vector3d& p : points) cloud.Dot(p, 0, kMeasured);
  for (const Eigen::Vector3d& m : finder->model().coarse().surface.points) cloud.Dot(registered * m, 1, kModel);
  DrawBox(hypotheses.world_T_estimate, half, cloud);
  save(cloud.image(), "perception-cloud.png",
       "Measured points (grey) as the camera sees them, the registered model (blue), the box of hypotheses (orange); "
       "0.5 m "
       "across.");

  Plot above(kSide, 0.1, [&](const Eigen::Vector3d& p) -> Eigen::Vector2d {
    const Eigen::Vector3d q = p - truth.translation();
    return {q.x(), q.y()};
  });
  for (const Eigen::Vector3d& p : points) above.Dot(p, 1, kMeasured);
  DrawBox(hypotheses.world_T_estimate, half, above);
  above.Dot(registered.translation(), 4, kModel);
  above.Dot(truth.translation(), 4, kTruth);
  save(
      above.image(), "perception-hypotheses.png",
      fmt::format(
          "The port from above, 0.1 m across: box of {} x {} x {} mm of hypotheses (orange), registered origin (blue), "
          "true origin (green).",
          2e3 * half.x(), 2e3 * half.y(), 2e3 * half.z()));
  return pictures;
}

}  // namespace feeler::evaluation
