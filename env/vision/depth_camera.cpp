#include "feeler/env/vision/depth_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

RendererOptions RenderingOf(const DepthCameraOptions& options) {
  RendererOptions rendering;
  rendering.width = options.width;
  rendering.height = options.height;
  rendering.samples = 0;
  rendering.shadows = false;
  return rendering;
}

/// The step in depth per pixel along a row or a column, on the surface that the pixel shows: the smaller of the two
/// one-sided differences, which does not cross an edge.
double DepthStep(double before, double here, double after) {
  const double back = here - before;
  const double ahead = after - here;
  if (before <= 0.0) return after <= 0.0 ? 0.0 : ahead;
  if (after <= 0.0) return back;
  return std::abs(back) < std::abs(ahead) ? back : ahead;
}

}  // namespace

double AssumedAlbedo(const mjModel& model, int geom) {
  const int material = model.geom_matid[geom];
  const float* rgba = material >= 0 ? model.mat_rgba + 4 * material : model.geom_rgba + 4 * geom;
  const double brightness = 0.2126 * static_cast<double>(rgba[0]) + 0.7152 * static_cast<double>(rgba[1]) +
                            0.0722 * static_cast<double>(rgba[2]);
  return 0.08 + 0.85 * std::clamp(brightness, 0.0, 1.0);
}

DepthCamera::DepthCamera(std::shared_ptr<const Scene> scene, const DepthCameraOptions& options)
    : scene_(std::move(scene)),
      options_(options),
      renderer_(scene_->drawn_model, RenderingOf(options)),
      drawn_(MakeData(*scene_->drawn_model)) {
  const mjModel& model = *scene_->drawn_model;
  camera_ = mj_name2id(&model, mjOBJ_CAMERA, options.camera.c_str());
  if (camera_ < 0)
    throw InputError("depth camera", fmt::format("the scene has no camera '{}'", options.camera),
                     "name a camera of the scene");
  if (!(options.farthest_m > 0.0))
    throw InputError("depth camera", "farthest_m is not above zero", "give a positive number");
  for (int geom = 0; geom < model.ngeom; ++geom) {
    geom_albedo_.push_back(static_cast<float>(AssumedAlbedo(model, geom)));
  }
}

CameraModel DepthCamera::Nominal(const mjData& data) {
  CopyForDrawing(*scene_, data, *drawn_);
  return CameraModelOf(*scene_->drawn_model, *drawn_, camera_, options_.width, options_.height);
}

DepthView DepthCamera::View(const mjData& data, const Installation& installation) {
  const CameraModel nominal = Nominal(data);
  const Pose truth = nominal.world_T_camera * installation.believed_T_true;
  Eigen::Matrix3d axes = truth.linear();
  axes.rightCols<2>() *= -1.0;  // MuJoCo's cameras look along -z with y upwards
  Eigen::Map<Eigen::Vector3d>(drawn_->cam_xpos + 3 * camera_) = truth.translation();
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(drawn_->cam_xmat + 9 * camera_) = axes;
  SurfaceImage surface = renderer_.Surface(*drawn_, NamedCamera{options_.camera});
  geoms_ = std::move(surface.geom);

  DepthView view;
  view.depth = std::move(surface.depth);
  const std::size_t pixels = view.depth.depth_m.size();
  view.ray_length.resize(pixels);
  view.albedo.assign(pixels, 0.0F);
  view.cosine.assign(pixels, 1.0F);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (geoms_[i] < 0 || view.depth.depth_m[i] > options_.farthest_m) {
      view.depth.depth_m[i] = 0.0F;
    } else {
      view.albedo[i] = geom_albedo_[static_cast<std::size_t>(geoms_[i])];
    }
  }
  const DepthImage& depth = view.depth;
  const auto at = [&](int row, int column) {
    const bool inside = row >= 0 && column >= 0 && row < depth.height && column < depth.width;
    return inside ? static_cast<double>(depth.at(row, column)) : 0.0;
  };
  std::size_t i = 0;
  for (int row = 0; row < depth.height; ++row) {
    for (int column = 0; column < depth.width; ++column, ++i) {
      const double x = (column - nominal.cx) / nominal.fx;
      const double y = (row - nominal.cy) / nominal.fy;
      view.ray_length[i] = static_cast<float>(std::sqrt(1.0 + x * x + y * y));
      const double z = depth.depth_m[i];
      if (z <= 0.0) continue;
      // Tangents of the surface z(u, v) at the point z (x, y, 1).
      const double zu = DepthStep(at(row, column - 1), z, at(row, column + 1));
      const double zv = DepthStep(at(row - 1, column), z, at(row + 1, column));
      const Eigen::Vector3d along_u(zu * x + z / nominal.fx, zu * y, zu);
      const Eigen::Vector3d along_v(zv * x, zv * y + z / nominal.fy, zv);
      const Eigen::Vector3d normal = along_u.cross(along_v).normalized();
      view.cosine[i] = static_cast<float>(std::abs(normal.dot(Eigen::Vector3d(x, y, 1.0).normalized())));
    }
  }
  return view;
}

DepthCapture DepthCamera::Exact(const mjData& data) {
  DepthCapture capture;
  capture.depth = View(data, {}).depth;
  capture.model = CameraModelOf(*scene_->drawn_model, *drawn_, camera_, options_.width, options_.height);
  return capture;
}

DepthCapture DepthCamera::Noisy(const mjData& data, const DepthNoiseOptions& noise, const Installation& installation,
                                RandomStream& random, int averaged_frames) {
  DepthCapture capture;
  capture.model = Nominal(data);
  capture.depth = AddDepthNoise(View(data, installation), noise, installation, averaged_frames, random);
  return capture;
}

}  // namespace feeler::env
