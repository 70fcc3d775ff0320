// Pictures without a screen. Oracles: MuJoCo's ray casting for depth and camera model; zlib for the PNG; ffprobe for
// the video. Laws: same state, same picture; what moves is seen to move; lids and collision shapes are not drawn; a
// file is complete or not there.

#include "feeler/env/vision/renderer.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/random.h"
#include "feeler/env/vision/video.h"

namespace feeler::env {
namespace {

const Scene& DrawnPlug() {
  static const Scene scene = BuildScene(LoadTask("plug"));
  return scene;
}

RendererOptions Small() {
  RendererOptions options;
  options.width = 320;
  options.height = 240;
  options.shadows = false;
  return options;
}

class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& name) : path_(std::filesystem::path(testing::TempDir()) / name) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  bool empty() const { return std::filesystem::is_empty(path_); }

 private:
  std::filesystem::path path_;
};

TEST(Renderer, DepthAgreesWithRayCasting) {
  const Scene& scene = DrawnPlug();
  const DataHandle data = MakeData(*scene.drawn_model);
  ResetScene(scene, scene.home_q_rad, *data);
  Renderer renderer(scene.drawn_model, Small());
  for (const FreeCamera& camera : {OverviewCamera(scene), CloseUpCamera(scene)}) {
    const DepthImage depth = renderer.Depth(*data, camera);
    const CameraModel model = renderer.Model(*data, camera);
    EXPECT_NEAR(model.world_T_camera.linear().determinant(), 1.0, 1e-5);
    EXPECT_NEAR((model.world_T_camera.translation() - camera.look_at_m).norm(), camera.distance_m, 1e-4);
    const std::array<mjtByte, mjNGROUP> drawn = {1, 1, 1, 0, 0, 0};
    RandomStream random(1, 0, "rays");
    std::vector<double> errors;
    for (int sample = 0; sample < 2000; ++sample) {
      const int u = static_cast<int>(random.Index(320));
      const int v = static_cast<int>(random.Index(240));
      const Eigen::Vector3d local((u - model.cx) / model.fx, (v - model.cy) / model.fy, 1.0);
      const Eigen::Vector3d ray = model.world_T_camera.linear() * local;
      const Eigen::Vector3d origin = model.world_T_camera.translation();
      int geom = -1;
      const double distance =
          mj_ray(scene.drawn_model.get(), data.get(), origin.data(), ray.data(), drawn.data(), 1, -1, &geom);
      if (distance > 0.0) errors.push_back(std::abs(depth.at(v, u) - distance));  // along the ray, z = 1 a unit
    }
    ASSERT_GT(errors.size(), 500U);
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() / 2], 3e-4) << "metres";
    EXPECT_LT(errors[errors.size() * 9 / 10], 2e-3) << "but for edges and facets";
    RecordProperty("depth_error_median_um", std::to_string(errors[errors.size() / 2] * 1e6));
  }
}

TEST(Renderer, SameStateSamePictureAndMotionIsSeen) {
  const Scene& scene = DrawnPlug();
  const DataHandle data = MakeData(*scene.drawn_model);
  ResetScene(scene, scene.home_q_rad, *data);
  const Camera camera = CloseUpCamera(scene);
  Image first;
  {
    Renderer renderer(scene.drawn_model, Small());
    first = renderer.Color(*data, camera);
    renderer.Depth(*data, camera);
    EXPECT_EQ(renderer.Color(*data, camera).rgb, first.rgb) << "a depth picture in between changes nothing";
  }
  Renderer another(scene.drawn_model, Small());
  EXPECT_EQ(another.Color(*data, camera).rgb, first.rgb);
  EXPECT_GT(*std::max_element(first.rgb.begin(), first.rgb.end()), 100);
  EXPECT_LT(*std::min_element(first.rgb.begin(), first.rgb.end()), 60);
  SetTargetPose(scene, scene.task.world_T_target * Eigen::Translation3d(0.01, 0.0, 0.0), *data);
  mj_forward(scene.drawn_model.get(), data.get());
  EXPECT_NE(another.Color(*data, camera).rgb, first.rgb);
  EXPECT_THROW(another.Color(*data, NamedCamera{"no such camera"}), InputError);
}

TEST(Renderer, SceneImageShowsTaskOrSaysWhyNot) {
  const Scene& scene = DrawnPlug();
  const Image image = RenderSceneImage(scene, SceneView::kCloseUp, Small());
  EXPECT_EQ(image.rgb.size(), 3U * 320U * 240U);
  EXPECT_THROW(RenderSceneImage(scene, MakePose(Eigen::Vector3d(5, 0, 0)), SceneView::kOverview, Small()), InputError);
  RendererOptions absurd;
  absurd.width = -1;
  EXPECT_THROW(Renderer(scene.drawn_model, absurd), InputError);
}

std::uint32_t BigEndian(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

TEST(Png, HoldsThePicture) {
  RandomStream random(1, 0, "png");
  Image image{7, 5, {}};
  for (int i = 0; i < 3 * 7 * 5; ++i) image.rgb.push_back(static_cast<std::uint8_t>(random.Index(256)));
  const std::string png = EncodePng(image);
  ASSERT_EQ(png.substr(1, 3), "PNG");
  EXPECT_EQ(BigEndian(png, 16), 7U);
  EXPECT_EQ(BigEndian(png, 20), 5U);
  const std::size_t data = 33;  // signature 8, header chunk 25
  ASSERT_EQ(png.substr(data + 4, 4), "IDAT");
  std::vector<std::uint8_t> rows(5 * (1 + 3 * 7));
  uLongf size = rows.size();
  ASSERT_EQ(uncompress(rows.data(), &size, reinterpret_cast<const Bytef*>(png.data() + data + 8), BigEndian(png, data)),
            Z_OK);
  for (std::size_t row = 0; row < 5; ++row) {
    ASSERT_EQ(rows[row * 22], 2);  // difference to the row above
    for (std::size_t i = 0; i < 21; ++i) {
      std::uint8_t value = rows[row * 22 + 1 + i];
      if (row > 0) value = static_cast<std::uint8_t>(value + image.rgb[(row - 1) * 21 + i]);
      EXPECT_EQ(value, image.rgb[row * 21 + i]);
    }
  }
  EXPECT_THROW(EncodePng(Image{}), InputError);
  EXPECT_THROW(WritePng(image, "/nonexistent/folder/a.png"), InputError);
}

Image Frame(int width, int height, int shade) {
  return {width, height,
          std::vector<std::uint8_t>(static_cast<std::size_t>(3 * width * height), static_cast<std::uint8_t>(shade))};
}

VideoOptions SmallVideo() {
  VideoOptions options;
  options.width = 64;
  options.height = 48;
  return options;
}

TEST(Video, IsPlayableAndComplete) {
  const TemporaryFolder folder("feeler_video_written");
  const std::string path = folder / "a 'b' $c.mp4";  // no shell is between us and the name
  const VideoOptions options = SmallVideo();
  VideoWriter video(path, options);
  for (int i = 0; i < 12; ++i) video.Add(Frame(64, 48, 20 * i));
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_THROW(video.Add(Frame(32, 48, 0)), InputError);
  video.Finish();
  ASSERT_TRUE(std::filesystem::exists(path));
  const std::string copy = folder / "copy.mp4";
  std::filesystem::copy_file(path, copy);
  const std::string command =
      "ffprobe -v error -count_frames -show_entries stream=codec_name,pix_fmt,width,height,nb_read_frames -of "
      "csv=p=0 " +
      copy;
  std::FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::array<char, 200> line{};
  ASSERT_NE(std::fgets(line.data(), static_cast<int>(line.size()), pipe), nullptr);
  pclose(pipe);
  EXPECT_EQ(std::string(line.data()), "h264,64,48,yuv420p,12\n");
}

TEST(Video, LeavesNothingBehindWhenItIsNotFinished) {
  const TemporaryFolder folder("feeler_video_unfinished");
  VideoOptions options = SmallVideo();
  {
    VideoWriter video(folder / "a.mp4", options);
    video.Add(Frame(64, 48, 100));
  }
  EXPECT_TRUE(folder.empty());
  {
    VideoWriter video(folder / "a.mp4", options);
    EXPECT_THROW(video.Finish(), InputError) << "no frames";
  }
  EXPECT_TRUE(folder.empty());
  options.width = 63;
  EXPECT_THROW(VideoWriter(folder / "a.mp4", options), InputError);
  options.width = 64;
  EXPECT_THROW(VideoWriter("/nonexistent/folder/a.mp4", options), InputError);
}

// An encoder that comes to its output late must not make anew what a signal has taken away.
TEST(Video, IsNotMadeAnewAfterASignalTookItAway) {
  const TemporaryFolder folder("feeler_video_signalled");
  const VideoOptions options = SmallVideo();
  {
    VideoWriter video(folder / "a.mp4", options);
    SettleOutputsInSignalHandler();
    video.Add(Frame(64, 48, 100));
    EXPECT_THROW(video.Finish(), InputError);
  }
  EXPECT_TRUE(folder.empty());
}

TEST(Video, SaysThatFfmpegIsMissing) {
  const TemporaryFolder folder("feeler_video_refused");
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  EXPECT_THROW(VideoWriter(folder / "a.mp4"), InputError);
  setenv("PATH", path.c_str(), 1);
  EXPECT_TRUE(folder.empty());
}

}  // namespace
}  // namespace feeler::env
