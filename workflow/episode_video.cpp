#include "workflow/episode_video.h"

#include <algorithm>

#include "env/mujoco_handles.h"
#include "env/renderer.h"
#include "env/video.h"

namespace feeler::workflow {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr int kFramesPerSecond = 25;

/// Two pictures of the same height, side by side.
env::Image Beside(const env::Image& left, const env::Image& right) {
  env::Image both{left.width + right.width, left.height, {}};
  both.rgb.reserve(left.rgb.size() + right.rgb.size());
  for (int row = 0; row < left.height; ++row) {
    both.rgb.insert(both.rgb.end(), left.at(row, 0), left.at(row, 0) + 3 * left.width);
    both.rgb.insert(both.rgb.end(), right.at(row, 0), right.at(row, 0) + 3 * right.width);
  }
  return both;
}

}  // namespace

EpisodeRecord RecordEpisodeVideo(EpisodeRunner& runner, std::uint64_t episode, const std::string& path,
                                 const ProgressCallback& progress) {
  env::SimulatedRobot& robot = runner.environment().robot();
  const env::Scene& scene = robot.world().scene();
  env::RendererOptions half;
  half.width = kWidth / 2;
  half.height = kHeight;
  env::Renderer renderer(scene.drawn_model, half);
  env::VideoOptions video_options;
  video_options.width = kWidth;
  video_options.height = kHeight;
  video_options.frames_per_second = kFramesPerSecond;
  env::VideoWriter video(path, video_options);
  const env::DataHandle frame = env::MakeData(*scene.drawn_model);
  const env::Camera overview = env::OverviewCamera(scene);
  const env::Camera close_up = env::CloseUpCamera(scene);

  robot.SetObserver(
      [&](const env::World& world) {
        env::CopyForDrawing(scene, world.data(), *frame);
        video.Add(Beside(renderer.Color(*frame, overview), renderer.Color(*frame, close_up)));
        // How long the episode will last is not known: the bar shows frames against the usual length of 300.
        if (progress) progress(video.frames(), std::max<std::int64_t>(300, video.frames() + 1));
      },
      1.0 / kFramesPerSecond);
  const EpisodeRecord record = runner.Run(episode);
  robot.SetObserver({}, 0.0);
  video.Finish();
  if (progress) progress(video.frames(), video.frames());
  return record;
}

}  // namespace feeler::workflow
