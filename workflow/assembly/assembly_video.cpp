#include "feeler/workflow/assembly/assembly_video.h"

#include <fmt/format.h>

#include <cstdint>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/vision/renderer.h"
#include "feeler/env/vision/video.h"
#include "feeler/workflow/assembly/assembly_stage.h"

namespace feeler::workflow {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr int kInsetWidth = 384;
constexpr int kInsetHeight = 288;
constexpr int kMargin = 14;
constexpr int kCaptionHeight = 40;
constexpr int kFramesPerSecond = 25;
constexpr int kEndFrames = 2 * kFramesPerSecond;  ///< to read the verdict

env::FreeCamera CellCamera() {
  env::FreeCamera camera;
  camera.look_at_m = {0.5, 0.0, 0.32};
  camera.distance_m = 1.75;
  camera.azimuth_deg = 138.0;
  camera.elevation_deg = -20.0;
  return camera;
}

env::RendererOptions Size(int width, int height) {
  env::RendererOptions options;
  options.width = width;
  options.height = height;
  return options;
}

cv::Mat View(env::Image& image) { return {image.height, image.width, CV_8UC3, image.rgb.data()}; }

/// A film segment as pictures.
class SegmentCamera {
 public:
  explicit SegmentCamera(std::shared_ptr<const env::Scene> scene)
      : scene_(std::move(scene)),
        cell_(scene_->drawn_model, Size(kWidth, kHeight)),
        near_(scene_->drawn_model, Size(kInsetWidth, kInsetHeight)),
        data_(env::MakeData(*scene_->drawn_model)) {}

  env::Image Draw(const env::JointVector& q_rad) {
    env::SetJointPositions(*scene_, q_rad, *data_);
    env::SetTargetPose(*scene_, scene_->task.world_T_target, *data_);
    mj_kinematics(scene_->drawn_model.get(), data_.get());
    mj_comPos(scene_->drawn_model.get(), data_.get());
    mj_camlight(scene_->drawn_model.get(), data_.get());
    env::Image image = cell_.Color(*data_, env::Camera(CellCamera()));
    env::FreeCamera at_tool = CellCamera();
    at_tool.look_at_m = env::ToolForwardKinematics(*scene_, q_rad).translation();
    at_tool.distance_m = 0.55;
    env::Image inset = near_.Color(*data_, env::Camera(at_tool));
    const cv::Rect place(kWidth - kInsetWidth - kMargin, kHeight - kInsetHeight - kMargin, kInsetWidth, kInsetHeight);
    View(inset).copyTo(View(image)(place));
    cv::rectangle(View(image), place, cv::Scalar(40, 40, 44), 2);
    return image;
  }

 private:
  std::shared_ptr<const env::Scene> scene_;
  env::Renderer cell_;
  env::Renderer near_;
  env::DataHandle data_;
};

void WriteCaption(const std::string& left, const std::string& right, const cv::Scalar& color, env::Image& image) {
  cv::Mat band = View(image)(cv::Rect(0, 0, image.width, kCaptionHeight));
  band *= 0.25;
  constexpr double kScale = 0.62;
  cv::putText(band, left, {14, 27}, cv::FONT_HERSHEY_SIMPLEX, kScale, color, 1, cv::LINE_AA);
  int baseline = 0;
  const int width = cv::getTextSize(right, cv::FONT_HERSHEY_SIMPLEX, kScale, 1, &baseline).width;
  cv::putText(band, right, {image.width - 14 - width, 27}, cv::FONT_HERSHEY_SIMPLEX, kScale, color, 1, cv::LINE_AA);
}

env::Image Still(const Assembly& assembly, std::size_t insertion, const std::vector<Pose>& world_T_part) {
  const env::Scene scene = BuildStage(assembly, {insertion, StagePhase::kFetch, 0.0, world_T_part});
  env::Renderer renderer(scene.drawn_model, Size(kWidth, kHeight));
  const env::DataHandle data = env::MakeData(*scene.drawn_model);
  env::SetJointPositions(scene, scene.home_q_rad, *data);
  env::SetTargetPose(scene, scene.task.world_T_target, *data);
  mj_kinematics(scene.drawn_model.get(), data.get());
  mj_comPos(scene.drawn_model.get(), data.get());
  mj_camlight(scene.drawn_model.get(), data.get());
  return renderer.Color(*data, env::Camera(CellCamera()));
}

}  // namespace

env::Image RenderAssembly(const Assembly& assembly, const AssemblyPlan& plan) {
  return Still(assembly, assembly.insertions.size() - 1, plan.world_T_part);
}

env::Image RenderAssemblyStart(const Assembly& assembly, const AssemblyPlan& /*plan*/) {
  std::vector<Pose> poses;
  for (const AssemblyPart& part : assembly.parts) poses.push_back(part.world_T_part);
  return Still(assembly, 0, poses);
}

void WriteAssemblyVideo(const Assembly& assembly, const AssemblyFilm& film, const AssemblyRecord& record,
                        const std::string& path, const ProgressCallback& progress) {
  std::int64_t total = kEndFrames;
  for (const AssemblyFilm::Segment& segment : film.segments) total += static_cast<std::int64_t>(segment.frames.size());
  if (total == kEndFrames) throw InputError("video", "nothing was filmed", "build at least one step");
  env::VideoOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.frames_per_second = kFramesPerSecond;
  env::VideoWriter video(path, options);
  const cv::Scalar white(245, 245, 245);
  const std::string speed = fmt::format("{:.0f}x", film.period_s * kFramesPerSecond);
  std::int64_t done = 0;
  env::Image last;
  for (const AssemblyFilm::Segment& segment : film.segments) {
    if (segment.frames.empty()) continue;
    SegmentCamera camera(segment.scene);
    for (const AssemblyFilm::Frame& frame : segment.frames) {
      last = camera.Draw(frame.q_rad);
      env::Image image = last;
      WriteCaption(assembly.name + "   " + segment.caption, fmt::format("{:.1f} s   {}", frame.time_s, speed), white,
                   image);
      video.Add(image);
      if (progress) progress(++done, total);
    }
  }
  const cv::Scalar color = record.complete ? cv::Scalar(130, 230, 150) : cv::Scalar(255, 150, 130);
  WriteCaption(assembly.name + "   " + record.reason, fmt::format("{:.1f} s", record.sim_time_s), color, last);
  for (int i = 0; i < kEndFrames; ++i) {
    video.Add(last);
    if (progress) progress(++done, total);
  }
  video.Finish();
}

}  // namespace feeler::workflow
