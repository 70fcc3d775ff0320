#include "feeler/env/vision/wrist_camera.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

RendererOptions WristRenderingOf(const WristCameraOptions& options) {
  RendererOptions rendering;
  rendering.width = options.width;
  rendering.height = options.height;
  rendering.samples = options.samples;
  rendering.shadows = options.shadows;
  return rendering;
}

/// Adds noise to every value: the sum of two uniform bytes, whose distribution is a triangle, scaled. Near enough to
/// normal, and four values come from one draw: a picture has a million.
void AddNoise(double levels, RandomStream& random, std::vector<std::uint8_t>& values) {
  const double kDeviation = std::sqrt(2.0 * (256.0 * 256.0 - 1.0) / 12.0);
  const double scale = levels / kDeviation;
  std::uint64_t bits = 0;
  int left = 0;
  for (std::uint8_t& value : values) {
    if (left == 0) {
      bits = random.Next();
      left = 4;
    }
    const auto sum = static_cast<int>(bits & 255U) + static_cast<int>(bits >> 8U & 255U);
    bits >>= 16U;
    --left;
    const double noisy = value + scale * (sum - 255);
    value = static_cast<std::uint8_t>(std::clamp(std::lround(noisy), 0L, 255L));
  }
}

bool Within(const mjModel& model, int body, int ancestor) {
  while (body > ancestor) body = model.body_parentid[body];
  return body == ancestor;
}

}  // namespace

WristCamera::WristCamera(std::shared_ptr<const Scene> scene, const WristCameraOptions& options)
    : scene_(std::move(scene)),
      options_(options),
      camera_(mj_name2id(scene_->drawn_model.get(), mjOBJ_CAMERA, kWristCamera)),
      renderer_(scene_->drawn_model, WristRenderingOf(options)),
      drawn_(MakeData(*scene_->drawn_model)) {
  if (camera_ < 0) throw InputError("wrist camera", "the scene has none", "name a camera on the robot `wrist`");
}

CameraView WristCamera::Look(const mjData& data, RandomStream* noise) {
  CopyForDrawing(*scene_, data, *drawn_);
  Image image = renderer_.Color(*drawn_, NamedCamera{kWristCamera});
  if (noise != nullptr && options_.noise_levels > 0.0) AddNoise(options_.noise_levels, *noise, image.rgb);
  const CameraModel model = CameraModelOf(*scene_->drawn_model, *drawn_, camera_, options_.width, options_.height);
  CameraView view;
  view.width = image.width;
  view.height = image.height;
  view.rgb = std::move(image.rgb);
  view.fx = model.fx;
  view.fy = model.fy;
  view.cx = model.cx;
  view.cy = model.cy;
  view.tool_T_camera = BodyPose(*drawn_, scene_->tool_body).inverse() * model.world_T_camera;
  return view;
}

SurfaceImage WristCamera::Surface(const mjData& data) {
  CopyForDrawing(*scene_, data, *drawn_);
  return renderer_.Surface(*drawn_, NamedCamera{kWristCamera});
}

std::vector<std::uint8_t> WristCamera::OwnBody(const SurfaceImage& surface) const {
  const mjModel& model = *scene_->drawn_model;
  const int root = model.body_rootid[scene_->tool_body];
  std::vector<std::uint8_t> own;
  own.reserve(surface.geom.size());
  for (const int geom : surface.geom) {
    own.push_back(geom >= 0 && Within(model, model.geom_bodyid[geom], root) ? 1 : 0);
  }
  return own;
}

}  // namespace feeler::env
