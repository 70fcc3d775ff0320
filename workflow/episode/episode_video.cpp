#include "feeler/workflow/episode/episode_video.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/vision/renderer.h"
#include "feeler/env/vision/video.h"

namespace feeler::workflow {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr int kInsetWidth = 224;
constexpr int kInsetHeight = 168;
constexpr int kMargin = 12;
constexpr int kCaptionHeight = 40;
constexpr int kFramesPerSecond = 25;

cv::Mat View(env::Image& image) { return {image.height, image.width, CV_8UC3, image.rgb.data()}; }

/// Copies `small` into `large` with its upper left corner at (x, y).
void Paste(env::Image& small, env::Image& large, int x, int y) {
  View(small).copyTo(View(large)(cv::Rect(x, y, small.width, small.height)));
}

/// A dark band with the name of the policy and what Caption says, x..x+width at the top.
void WriteCaption(const EpisodeFilm& film, std::size_t frame, env::Image& image, int x, int width) {
  cv::Mat band = View(image)(cv::Rect(x, 0, width, kCaptionHeight));
  band *= 0.25;
  const bool ended = frame + 1 >= film.frames.size();
  const cv::Scalar white(245, 245, 245);
  const cv::Scalar color = !ended                 ? white
                           : film.record.inserted ? cv::Scalar(130, 230, 150)
                                                  : cv::Scalar(255, 150, 130);
  constexpr double kScale = 0.62;
  cv::putText(band, film.label, {14, 27}, cv::FONT_HERSHEY_SIMPLEX, kScale, white, 1, cv::LINE_AA);
  int baseline = 0;
  std::string text = Caption(film, frame);
  const auto text_width = [&] { return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kScale, 1, &baseline).width; };
  const int room = width - 42 - cv::getTextSize(film.label, cv::FONT_HERSHEY_SIMPLEX, kScale, 1, &baseline).width;
  while (text.size() > 4 && text_width() > room) text.replace(text.size() - 4, 4, "...");
  cv::putText(band, text, {width - 14 - text_width(), 27}, cv::FONT_HERSHEY_SIMPLEX, kScale, color, 1, cv::LINE_AA);
}

/// Draws the frames of a film from its two cameras.
class Projector {
 public:
  Projector(const EpisodeFilm& film, bool beside)
      : film_(film),
        near_(film.scene->drawn_model, Options(kWidth / 2, kHeight)),
        far_(film.scene->drawn_model, beside ? Options(kInsetWidth, kInsetHeight) : Options(kWidth / 2, kHeight)),
        data_(env::MakeData(*film.scene->drawn_model)) {}

  struct Pictures {
    env::Image near;
    env::Image far;
  };
  Pictures Draw(std::size_t frame) {
    const env::Scene& scene = *film_.scene;
    const EpisodeFilm::Frame& state = film_.frames[std::min(frame, film_.frames.size() - 1)];
    env::SetJointPositions(scene, state.q_rad, *data_);
    env::SetTargetPose(scene, state.world_T_target, *data_);
    mj_kinematics(scene.drawn_model.get(), data_.get());
    mj_comPos(scene.drawn_model.get(), data_.get());
    mj_camlight(scene.drawn_model.get(), data_.get());
    return {near_.Color(*data_, Camera(env::CloseUpCamera(scene))),
            far_.Color(*data_, Camera(env::OverviewCamera(scene)))};
  }

 private:
  static env::RendererOptions Options(int width, int height) {
    env::RendererOptions options;
    options.width = width;
    options.height = height;
    return options;
  }
  /// The cameras look at the nominal target; this one may stand elsewhere.
  env::FreeCamera Camera(env::FreeCamera camera) const {
    camera.look_at_m += film_.record.world_T_estimate0.translation() - film_.scene->task.world_T_target.translation();
    return camera;
  }

  const EpisodeFilm& film_;
  env::Renderer near_;
  env::Renderer far_;
  env::DataHandle data_;
};

}  // namespace

EpisodeFilm FilmEpisode(EpisodeRunner& runner, std::uint64_t episode, std::string label) {
  env::SimulatedRobot& robot = runner.environment().robot();
  EpisodeFilm film;
  film.label = std::move(label);
  film.scene = std::make_shared<const env::Scene>(robot.world().scene());
  const auto keep = [&film](const env::World& world) {
    film.frames.push_back({world.time_s(), world.q_rad(), world.TargetPose()});
  };
  robot.SetObserver(keep, 1.0 / kFramesPerSecond);
  film.record = runner.Run(episode);
  robot.SetObserver({}, 0.0);
  keep(robot.world());
  return film;
}

std::string Caption(const EpisodeFilm& film, std::size_t frame) {
  const double start_s = film.frames.back().time_s - film.record.execution.sim_time_s;
  if (frame + 1 >= film.frames.size()) {
    return film.record.inserted ? fmt::format("inserted after {:.2f} s", film.record.execution.sim_time_s)
                                : "failed: " + film.record.reason;
  }
  const double time_s = film.frames[frame].time_s - start_s;
  return time_s < 0.0 ? "to the start pose" : fmt::format("{:.2f} s", time_s);
}

void WriteVideo(const std::vector<EpisodeFilm>& films, const std::string& path, const ProgressCallback& progress) {
  if (films.empty() || films.size() > 2)
    throw InputError("video", fmt::format("{} episodes", films.size()), "film 1 or 2");
  const bool beside = films.size() == 2;
  std::vector<std::unique_ptr<Projector>> projectors;
  std::size_t frames = 0;
  for (const EpisodeFilm& film : films) {
    projectors.push_back(std::make_unique<Projector>(film, beside));
    frames = std::max(frames, film.frames.size());
  }
  frames += kFramesPerSecond;  // a second to read the verdict
  env::VideoOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.frames_per_second = kFramesPerSecond;
  env::VideoWriter video(path, options);
  env::Image image{kWidth, kHeight, std::vector<std::uint8_t>(std::size_t{3} * kWidth * kHeight)};
  for (std::size_t frame = 0; frame < frames; ++frame) {
    for (std::size_t i = 0; i < films.size(); ++i) {
      Projector::Pictures pictures = projectors[i]->Draw(frame);
      const int x = static_cast<int>(i) * kWidth / 2;
      if (beside) {
        Paste(pictures.near, image, x, 0);
        Paste(pictures.far, image, x + kMargin, kHeight - kInsetHeight - kMargin);
      } else {
        Paste(pictures.far, image, 0, 0);
        Paste(pictures.near, image, kWidth / 2, 0);
      }
      WriteCaption(films[i], frame, image, x, beside ? kWidth / 2 : kWidth);
    }
    if (beside) View(image)(cv::Rect(kWidth / 2 - 1, 0, 2, kHeight)).setTo(cv::Scalar(20, 20, 20));
    video.Add(image);
    if (progress) progress(static_cast<std::int64_t>(frame) + 1, static_cast<std::int64_t>(frames));
  }
  video.Finish();
}

EpisodeRecord RecordEpisodeVideo(EpisodeRunner& runner, std::uint64_t episode, const std::string& path,
                                 const ProgressCallback& progress) {
  std::vector<EpisodeFilm> films;
  films.push_back(FilmEpisode(runner, episode, ""));
  films.back().label = films.back().record.policy;
  WriteVideo(films, path, progress);
  return std::move(films.back().record);
}

}  // namespace feeler::workflow
