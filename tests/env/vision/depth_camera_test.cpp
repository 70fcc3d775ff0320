// Depth cameras. Oracle: MuJoCo's ray casting over the drawn model (another algorithm, double precision). Laws: with
// all noise off, noisy equals exact; every term switched on alone changes what it names and nothing else, in the size
// that its options give; same stream, same bits; averaging shrinks the random error; cameras add nothing to physics;
// the static camera sees the ports in the arm's reach past the arm at home.

#include "feeler/env/vision/depth_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "feeler/core/error.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

DepthCamera& PlugCamera() {
  static DepthCamera camera(PlugScene());
  return camera;
}

DataHandle Home() {
  DataHandle data = MakeData(*PlugScene()->model);
  ResetScene(*PlugScene(), PlugScene()->home_q_rad, *data);
  return data;
}

double Quantile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

// A wall at one distance, seen squarely.
DepthView Wall(double distance_m, double albedo = 0.5, double cosine = 1.0, int side = 100) {
  const auto pixels = static_cast<std::size_t>(side * side);
  DepthView view;
  view.depth = {side, side, std::vector<float>(pixels, static_cast<float>(distance_m))};
  view.ray_length.assign(pixels, 1.0F);
  view.albedo.assign(pixels, static_cast<float>(albedo));
  view.cosine.assign(pixels, static_cast<float>(cosine));
  return view;
}

std::vector<double> Errors(const DepthImage& noisy, const DepthImage& exact) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < noisy.depth_m.size(); ++i) {
    if (noisy.depth_m[i] > 0)
      errors.push_back(static_cast<double>(noisy.depth_m[i]) - static_cast<double>(exact.depth_m[i]));
  }
  return errors;
}

double Deviation(const std::vector<double>& errors) {
  double sum = 0.0;
  for (const double e : errors) sum += e * e;
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

TEST(DepthCamera, AgreesWithRayCasting) {
  const Scene& scene = *PlugScene();
  const DataHandle drawn = MakeData(*scene.drawn_model);
  const std::array<mjtByte, mjNGROUP> groups = {1, 1, 1, 0, 0, 0};
  RandomStream random(1, 0, "rays");
  for (int place = 0; place < 3; ++place) {
    const DataHandle data = Home();
    SetTargetPose(scene, MakePose({0.45 + 0.15 * place, 0.2 * place - 0.2, 0.15 + 0.1 * place}, 0.1 * place), *data);
    mj_forward(scene.model.get(), data.get());
    const DepthCapture capture = PlugCamera().Exact(*data);
    CopyForDrawing(scene, *data, *drawn);
    std::vector<double> errors;
    int other_geom = 0;
    for (int sample = 0; sample < 4000; ++sample) {
      const int u = static_cast<int>(random.Index(640));
      const int v = static_cast<int>(random.Index(576));
      const CameraModel& model = capture.model;
      const Eigen::Vector3d ray =
          model.world_T_camera.linear() * Eigen::Vector3d((u - model.cx) / model.fx, (v - model.cy) / model.fy, 1.0);
      const Eigen::Vector3d origin = model.world_T_camera.translation();
      int geom = -1;
      const double depth =
          mj_ray(scene.drawn_model.get(), drawn.get(), origin.data(), ray.data(), groups.data(), 1, -1, &geom);
      if (depth < 0 || depth > 5.0) continue;
      const auto pixel = static_cast<std::size_t>(v) * 640 + static_cast<std::size_t>(u);
      errors.push_back(std::abs(static_cast<double>(capture.depth.depth_m[pixel]) - depth));
      other_geom += geom != PlugCamera().geoms()[pixel] ? 1 : 0;
    }
    ASSERT_GT(errors.size(), 2000U);
    EXPECT_LE(Quantile(errors, 0.5), 5e-5) << "metres";
    EXPECT_LE(Quantile(errors, 0.9), 5e-4) << "metres";
    EXPECT_LT(other_geom, static_cast<int>(errors.size()) / 50) << "edges only";
    std::printf("[          ] place %d: median %.1f um, 90 %% %.1f um, other geom %d of %zu\n", place,
                1e6 * Quantile(errors, 0.5), 1e6 * Quantile(errors, 0.9), other_geom, errors.size());
  }
}

TEST(DepthCamera, WithoutNoiseIsExactAndSameStreamSameBits) {
  const DataHandle data = Home();
  const DepthCapture exact = PlugCamera().Exact(*data);
  RandomStream nothing(1, 0, "depth");
  EXPECT_EQ(PlugCamera().Noisy(*data, DepthNoiseOptions::Exact(), {}, nothing).depth.depth_m, exact.depth.depth_m);

  const DepthNoiseOptions noise;
  std::vector<float> first;
  for (int time = 0; time < 2; ++time) {
    RandomStream place(7, 0, "installation");
    RandomStream random(7, 3, "depth");
    DepthCamera camera(PlugScene());
    const DepthCapture capture = camera.Noisy(*data, noise, DrawInstallation(noise, place), random, 2);
    EXPECT_TRUE(capture.model.world_T_camera.isApprox(exact.model.world_T_camera)) << "the user knows no better";
    if (time == 0) first = capture.depth.depth_m;
    EXPECT_EQ(capture.depth.depth_m, first);
  }
  EXPECT_NE(first, exact.depth.depth_m);
}

TEST(DepthNoise, EachTermAloneDoesWhatItsOptionsSay) {
  const DepthNoiseOptions off = DepthNoiseOptions::Exact();
  const auto noisy = [](const DepthView& view, const DepthNoiseOptions& options, const Installation& place = {},
                        int frames = 1) {
    RandomStream random(3, 0, "depth");
    return AddDepthNoise(view, options, place, frames, random);
  };
  DepthNoiseOptions range = off;
  range.range = true;
  for (const double distance : {0.5, 1.0, 2.0}) {
    const DepthView wall = Wall(distance);
    EXPECT_NEAR(Deviation(Errors(noisy(wall, range), wall.depth)), 0.0006 + 0.0009 * distance * distance, 1e-4);
  }
  const double sigma = 0.0015;
  EXPECT_NEAR(Deviation(Errors(noisy(Wall(1.0), range, {}, 9), Wall(1.0).depth)), sigma / 3.0, 5e-5) << "mean of 9";
  DepthNoiseOptions albedo = range;
  albedo.albedo = true;
  EXPECT_NEAR(Deviation(Errors(noisy(Wall(1.0, 0.125), albedo), Wall(1.0).depth)), 2.0 * sigma, 1e-4);
  EXPECT_NEAR(Deviation(Errors(noisy(Wall(1.0, 0.125), range), Wall(1.0).depth)), sigma, 1e-4);
  DepthNoiseOptions incidence = range;
  incidence.incidence = true;
  EXPECT_NEAR(Deviation(Errors(noisy(Wall(1.0, 0.5, 0.25), incidence), Wall(1.0).depth)), 2.0 * sigma, 1e-4);

  DepthNoiseOptions quantisation = off;
  quantisation.quantisation = true;
  for (const float depth : noisy(Wall(1.23456), quantisation).depth_m) EXPECT_NEAR(depth, 1.235, 1e-6);
  DepthNoiseOptions dropout = off;
  dropout.dropout = true;
  EXPECT_NEAR(static_cast<double>(Errors(noisy(Wall(1.0), dropout), Wall(1.0).depth).size()), 9900.0, 50.0);
  EXPECT_TRUE(Errors(noisy(Wall(2.0, 0.1, 0.1), dropout), Wall(2.0).depth).empty()) << "too dark and slanted";
  DepthNoiseOptions bias = off;
  bias.bias = true;
  Installation place;
  place.bias_m = 0.0007;
  const double wiggle = 0.001 * std::sin(2.0 * M_PI * 1.5 / bias.wiggle_period_m);
  for (const float depth : noisy(Wall(1.5), bias, place).depth_m)
    EXPECT_NEAR(depth, 1.5 + 0.001 + 0.0015 + wiggle + 0.0007, 1e-6);

  DepthNoiseOptions flying = off;
  flying.flying_pixels = true;
  DepthView step = Wall(1.0);
  for (std::size_t i = 0; i < step.depth.depth_m.size(); ++i) {
    if (i % 100 >= 50) step.depth.depth_m[i] = 1.5F;
  }
  int between = 0;
  const DepthImage flown = noisy(step, flying);
  for (std::size_t i = 0; i < flown.depth_m.size(); ++i) {
    const bool at_edge = i % 100 == 49 || i % 100 == 50;
    if (flown.depth_m[i] != step.depth.depth_m[i]) {
      EXPECT_TRUE(at_edge);
      EXPECT_GT(flown.depth_m[i], 1.0F);
      EXPECT_LT(flown.depth_m[i], 1.5F);
      ++between;
    }
  }
  EXPECT_NEAR(between, 100, 25) << "half of the pixels at the edge";
}

TEST(DepthNoise, InstallationsStayWithinTheirBoundsAndBadOptionsAreRefused) {
  DepthNoiseOptions options;
  for (std::uint64_t i = 0; i < 200; ++i) {
    RandomStream random(5, i, "installation");
    const Installation place = DrawInstallation(options, random);
    EXPECT_LE(place.believed_T_true.translation().cwiseAbs().maxCoeff(), options.extrinsic_position_m);
    EXPECT_LE(Eigen::AngleAxisd(place.believed_T_true.linear()).angle(), options.extrinsic_angle_rad + 1e-9);
    EXPECT_LE(std::abs(place.bias_m), options.installation_bias_m);
  }
  RandomStream random(1, 0, "depth");
  EXPECT_THROW(AddDepthNoise(Wall(1.0), options, {}, 0, random), InputError);
  options.near_sigma_m = -1.0;
  EXPECT_THROW(AddDepthNoise(Wall(1.0), options, {}, 1, random), InputError);
  DepthCameraOptions unknown;
  unknown.camera = "no such camera";
  EXPECT_THROW(DepthCamera(PlugScene(), unknown), InputError);
}

TEST(DepthCamera, AddsNothingToPhysics) {
  const Scene& scene = *PlugScene();
  EXPECT_EQ(scene.model->ncam, 0);
  EXPECT_EQ(scene.drawn_model->ncam, 2);
  SceneOptions bare;
  bare.cameras.housings = false;
  const TaskModel task = LoadTask("plug");
  const Scene other = BuildScene(task, bare);
  ASSERT_EQ(other.model->nbody, scene.model->nbody);
  ASSERT_EQ(other.model->ngeom, scene.model->ngeom);
  EXPECT_TRUE(std::equal(other.model->body_mass, other.model->body_mass + other.model->nbody, scene.model->body_mass));
  EXPECT_TRUE(std::equal(other.model->body_inertia, other.model->body_inertia + 3 * other.model->nbody,
                         scene.model->body_inertia));
}

TEST(DepthCamera, StaticCameraSeesThePortsInReachPastTheArmAtHome) {
  const Scene& scene = *PlugScene();
  const DataHandle data = Home();
  int reachable = 0;
  int seen = 0;
  int whole = 0;
  double farthest = 0.0;
  for (double x = 0.35; x < 1.0; x += 0.1) {
    for (double y = -0.95; y < 1.0; y += 0.2) {
      for (double z = 0.05; z < 0.6; z += 0.25) {
        const Pose port = MakePose({x, y, z});
        if (ToolInverseKinematics(scene, port * Eigen::Translation3d(scene.task.start_offset_m)).empty()) continue;
        ++reachable;
        SetTargetPose(scene, port, *data);
        mj_forward(scene.model.get(), data.get());
        const DepthView view = PlugCamera().View(*data, {});
        int pixels = 0;
        for (const int geom : PlugCamera().geoms()) {
          if (geom >= 0 && scene.drawn_model->geom_bodyid[geom] == scene.target_body &&
              scene.drawn_model->geom_rbound[geom] < 0.06)
            ++pixels;
        }
        const CameraModel model = PlugCamera().Nominal(*data);
        const Eigen::Vector3d p = model.world_T_camera.inverse() * port.translation();
        farthest = std::max(farthest, p.norm());
        // What the housing covers at this distance, were nothing in front of it.
        const double expected = 0.058 * 0.05 * model.fx * model.fy / (p.z() * p.z());
        seen += pixels > 0.4 * expected ? 1 : 0;
        whole += pixels > 0.7 * expected ? 1 : 0;
      }
    }
  }
  std::printf("[          ] %d in reach, %d seen, %d whole, farthest %.2f m\n", reachable, seen, whole, farthest);
  EXPECT_GE(seen, reachable * 9 / 10);
  EXPECT_LT(farthest, 2.1);
}

}  // namespace
}  // namespace feeler::env
