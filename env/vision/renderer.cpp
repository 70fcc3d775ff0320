#include "feeler/env/vision/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "feeler/core/error.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/vision/egl_context.h"

namespace feeler::env {
namespace {

constexpr int kMaxGeoms = 4000;

// MuJoCo's scene, options and one GPU context; the OpenGL context must be current while it is made and destroyed.
class Drawing {
 public:
  Drawing(const mjModel& model, const RendererOptions& options, int samples) {
    // Buffer size and samples are settings of the model: a copy takes ours.
    ModelHandle sized(mj_copyModel(nullptr, &model));
    if (!sized) throw WorldError("MuJoCo", "no memory for the model");
    sized->vis.global.offwidth = options.width;
    sized->vis.global.offheight = options.height;
    sized->vis.quality.offsamples = samples;
    sized->vis.quality.shadowsize = options.shadow_resolution;
    mjv_defaultScene(&scene_);
    mjv_makeScene(sized.get(), &scene_, kMaxGeoms);
    mjr_defaultContext(&context_);
    mjr_makeContext(sized.get(), &context_, mjFONTSCALE_100);
    mjr_setBuffer(mjFB_OFFSCREEN, &context_);
    if (context_.currentBuffer != mjFB_OFFSCREEN) {
      throw InputError("rendering", "OpenGL has no off-screen buffers", "install libgl1-mesa-dri");
    }
  }
  ~Drawing() {
    mjr_freeContext(&context_);
    mjv_freeScene(&scene_);
  }
  Drawing(const Drawing&) = delete;
  Drawing& operator=(const Drawing&) = delete;

  mjvScene& scene() { return scene_; }
  const mjrContext& context() const { return context_; }

 private:
  mjvScene scene_;
  mjrContext context_;
};

mjvCamera ToMujoco(const mjModel& model, const Camera& camera) {
  mjvCamera result;
  mjv_defaultCamera(&result);
  if (const auto* free = std::get_if<FreeCamera>(&camera)) {
    result.type = mjCAMERA_FREE;
    for (int i = 0; i < 3; ++i) result.lookat[i] = free->look_at_m[i];
    result.distance = free->distance_m;
    result.azimuth = free->azimuth_deg;
    result.elevation = free->elevation_deg;
    return result;
  }
  const std::string& name = std::get<NamedCamera>(camera).name;
  result.type = mjCAMERA_FIXED;
  result.fixedcamid = mj_name2id(&model, mjOBJ_CAMERA, name.c_str());
  if (result.fixedcamid < 0) {
    throw InputError("rendering", fmt::format("no camera '{}' in the model", name), "name a camera of the task file");
  }
  return result;
}

}  // namespace

class Renderer::Context {
 public:
  Context(const mjModel& model, const RendererOptions& options) : model_(model), options_(options) {}
  ~Context() {
    try {
      const EglContext::Scope current(egl_);
      color_.reset();
      depth_.reset();
    } catch (const Error&) {  // the driver has gone; so have its buffers
    }
  }

  // Renders with the context current and hands the drawing to `read`.
  template <typename Read>
  void Render(mjData& data, const Camera& camera, bool for_depth, const Read& read, bool numbers = false) {
    mjvCamera view = ToMujoco(model_, camera);
    const EglContext::Scope current(egl_);
    std::unique_ptr<Drawing>& drawing = for_depth ? depth_ : color_;
    if (!drawing) drawing = std::make_unique<Drawing>(model_, options_, for_depth ? 0 : options_.samples);
    mjvOption shown;
    mjv_defaultOption(&shown);
    for (int group = 0; group < mjNGROUP; ++group) shown.sitegroup[group] = 0;
    mjv_updateScene(&model_, &data, &shown, nullptr, &view, mjCAT_ALL, &drawing->scene());
    drawing->scene().flags[mjRND_SHADOW] = options_.shadows && !for_depth ? 1 : 0;
    drawing->scene().flags[mjRND_REFLECTION] = for_depth ? 0 : 1;
    drawing->scene().flags[mjRND_SEGMENT] = numbers ? 1 : 0;
    drawing->scene().flags[mjRND_IDCOLOR] = numbers ? 1 : 0;
    mjr_render({0, 0, options_.width, options_.height}, &drawing->scene(), &drawing->context());
    read(*drawing);
  }

 private:
  const mjModel& model_;
  const RendererOptions& options_;
  EglContext egl_;
  std::unique_ptr<Drawing> color_;
  std::unique_ptr<Drawing> depth_;
};

Renderer::Renderer(std::shared_ptr<const mjModel> model, const RendererOptions& options)
    : model_(std::move(model)), options_(options) {
  if (options.width < 1 || options.height < 1 || options.width > 8192 || options.height > 8192 || options.samples < 0 ||
      options.samples > 16 || options.shadow_resolution < 1 || options.shadow_resolution > 8192) {
    throw InputError("rendering", "size, samples or shadow resolution out of range",
                     "1 to 8192 pixels a side, 0 to 16 samples");
  }
  RouteMujocoMessages();
  context_ = std::make_unique<Context>(*model_, options_);
}

Renderer::~Renderer() = default;

Image Renderer::Color(mjData& data, const Camera& camera) {
  Image image{options_.width, options_.height, {}};
  const auto row_bytes = 3 * static_cast<std::size_t>(image.width);
  image.rgb.resize(row_bytes * static_cast<std::size_t>(image.height));
  context_->Render(data, camera, false, [&](Drawing& drawing) {
    mjr_readPixels(image.rgb.data(), nullptr, {0, 0, image.width, image.height}, &drawing.context());
  });
  // OpenGL's rows begin at the bottom.
  for (int row = 0; row < image.height / 2; ++row) {
    std::uint8_t* top = image.rgb.data() + row_bytes * static_cast<std::size_t>(row);
    std::swap_ranges(top, top + row_bytes,
                     image.rgb.data() + row_bytes * static_cast<std::size_t>(image.height - 1 - row));
  }
  return image;
}

namespace {

// OpenGL's depth, rows from the bottom, to metres, rows from the top.
DepthImage MetricDepth(const std::vector<float>& buffer, int width, int height, double near, double far) {
  DepthImage image{width, height, {}};
  image.depth_m.resize(buffer.size());
  const auto columns = static_cast<std::size_t>(width);
  for (std::size_t row = 0; row < static_cast<std::size_t>(height); ++row) {
    const float* from = buffer.data() + columns * (static_cast<std::size_t>(height) - 1 - row);
    for (std::size_t column = 0; column < columns; ++column) {
      const double value = from[column];
      image.depth_m[row * columns + column] = static_cast<float>(near * far / (far - value * (far - near)));
    }
  }
  return image;
}

}  // namespace

DepthImage Renderer::Depth(mjData& data, const Camera& camera) {
  std::vector<float> buffer(static_cast<std::size_t>(options_.width) * static_cast<std::size_t>(options_.height));
  double near = 0.0;
  double far = 0.0;
  context_->Render(data, camera, true, [&](Drawing& drawing) {
    mjr_readPixels(nullptr, buffer.data(), {0, 0, options_.width, options_.height}, &drawing.context());
    near = drawing.scene().camera[0].frustum_near;
    far = drawing.scene().camera[0].frustum_far;
  });
  return MetricDepth(buffer, options_.width, options_.height, near, far);
}

SurfaceImage Renderer::Surface(mjData& data, const Camera& camera) {
  const auto columns = static_cast<std::size_t>(options_.width);
  const auto rows = static_cast<std::size_t>(options_.height);
  std::vector<float> buffer(columns * rows);
  std::vector<std::uint8_t> colors(3 * columns * rows);
  std::vector<int> geom_of_segment;
  double near = 0.0;
  double far = 0.0;
  const auto read = [&](Drawing& drawing) {
    const mjvScene& scene = drawing.scene();
    mjr_readPixels(colors.data(), buffer.data(), {0, 0, options_.width, options_.height}, &drawing.context());
    near = scene.camera[0].frustum_near;
    far = scene.camera[0].frustum_far;
    geom_of_segment.assign(static_cast<std::size_t>(scene.ngeom), -1);
    for (int i = 0; i < scene.ngeom; ++i) {
      const mjvGeom& geom = scene.geoms[i];
      if (geom.segid >= 0 && geom.segid < scene.ngeom && geom.objtype == mjOBJ_GEOM) {
        geom_of_segment[static_cast<std::size_t>(geom.segid)] = geom.objid;
      }
    }
  };
  context_->Render(data, camera, true, read, true);
  SurfaceImage surface{MetricDepth(buffer, options_.width, options_.height, near, far), {}};
  surface.geom.resize(columns * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const std::uint8_t* rgb = colors.data() + 3 * (columns * (rows - 1 - row) + column);
      const int segment = rgb[0] + 256 * rgb[1] + 65536 * rgb[2] - 1;  // black: nothing
      const bool known = segment >= 0 && segment < static_cast<int>(geom_of_segment.size());
      surface.geom[row * columns + column] = known ? geom_of_segment[static_cast<std::size_t>(segment)] : -1;
    }
  }
  return surface;
}

CameraModel Renderer::Model(mjData& data, const Camera& camera) {
  CameraModel result;
  result.width = options_.width;
  result.height = options_.height;
  result.cx = 0.5 * (result.width - 1);
  result.cy = 0.5 * (result.height - 1);
  context_->Render(data, camera, true, [&](Drawing& drawing) {
    // The two cameras of the scene are the eyes; ours is between them.
    const mjvGLCamera* eyes = drawing.scene().camera;
    const auto middle = [&](const float(mjvGLCamera::*member)[3]) {
      return Eigen::Vector3d(0.5 * (Eigen::Map<const Eigen::Vector3f>(eyes[0].*member) +
                                    Eigen::Map<const Eigen::Vector3f>(eyes[1].*member))
                                       .cast<double>());
    };
    const Eigen::Vector3d forward = middle(&mjvGLCamera::forward).normalized();
    const Eigen::Vector3d up = middle(&mjvGLCamera::up).normalized();
    result.world_T_camera.translation() = middle(&mjvGLCamera::pos);
    result.world_T_camera.linear().col(0) = forward.cross(up).normalized();
    result.world_T_camera.linear().col(1) = forward.cross(result.world_T_camera.linear().col(0));
    result.world_T_camera.linear().col(2) = forward;
    const double half_height = 0.5 * static_cast<double>(eyes[0].frustum_top - eyes[0].frustum_bottom);
    result.fy = 0.5 * result.height * static_cast<double>(eyes[0].frustum_near) / half_height;
    result.fx = result.fy;
  });
  return result;
}

CameraModel CameraModelOf(const mjModel& model, const mjData& data, int camera, int width, int height) {
  CameraModel result;
  result.width = width;
  result.height = height;
  result.cx = 0.5 * (width - 1);
  result.cy = 0.5 * (height - 1);
  const double half_angle = 0.5 * model.cam_fovy[camera] * std::numbers::pi / 180.0;
  result.fx = result.fy = 0.5 * height / std::tan(half_angle);
  result.world_T_camera.translation() = Eigen::Map<const Eigen::Vector3d>(data.cam_xpos + 3 * camera);
  Eigen::Matrix3d axes = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.cam_xmat + 9 * camera);
  axes.rightCols<2>() *= -1.0;  // MuJoCo's cameras look along -z with y upwards
  result.world_T_camera.linear() = axes;
  return result;
}

FreeCamera OverviewCamera(const Scene& scene) {
  const Eigen::Vector3d target = scene.task.world_T_target.translation();
  FreeCamera camera;
  camera.look_at_m = Eigen::Vector3d(0.55 * target.x(), 0.5 * target.y(), 0.34);
  camera.distance_m = 1.6;
  camera.azimuth_deg = 125.0;
  camera.elevation_deg = -16.0;
  return camera;
}

FreeCamera CloseUpCamera(const Scene& scene) {
  FreeCamera camera;
  camera.look_at_m = scene.task.world_T_target * Eigen::Vector3d(0.0, 0.0, 0.025);
  camera.distance_m = 0.3;
  camera.azimuth_deg = 128.0;
  camera.elevation_deg = -24.0;
  return camera;
}

Image RenderSceneImage(const Scene& scene, const Pose& world_T_tool, SceneView view, const RendererOptions& options) {
  const DataHandle data = MakeData(*scene.model);
  const std::vector<JointVector> branches = ToolInverseKinematics(scene, world_T_tool);
  if (branches.empty()) throw InputError("rendering", "the pose of the tool is out of reach", "move the target nearer");
  // Of several ways to stand there, one without contact and nearest to home: elbow up, as one knows the arm.
  JointVector best = branches.front();
  double best_score = 1e9;
  for (const JointVector& q : branches) {
    ResetScene(scene, q, *data);
    const double score = (q - scene.home_q_rad).norm() + (data->ncon > 0 ? 100.0 : 0.0);
    if (score < best_score) {
      best_score = score;
      best = q;
    }
  }
  ResetScene(scene, best, *data);
  RendererOptions still = options;
  still.shadow_resolution = 8192;
  Renderer renderer(scene.drawn_model, still);
  const DataHandle drawn = MakeData(*scene.drawn_model);
  CopyForDrawing(scene, *data, *drawn);
  return renderer.Color(*drawn, view == SceneView::kOverview ? OverviewCamera(scene) : CloseUpCamera(scene));
}

Image RenderSceneImage(const Scene& scene, SceneView view, const RendererOptions& options) {
  return RenderSceneImage(scene, scene.task.world_T_target * Eigen::Translation3d(scene.task.start_offset_m), view,
                          options);
}

}  // namespace feeler::env
