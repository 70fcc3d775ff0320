#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/env/scene/scene.h"
#include "feeler/env/vision/image.h"

namespace feeler::env {

/// A camera that looks at a point from a distance. Azimuth 0 looks along +x, 90 along +y; a negative elevation looks
/// down.
struct FreeCamera {
  Eigen::Vector3d look_at_m = Eigen::Vector3d::Zero();
  double distance_m = 1.5;
  double azimuth_deg = 135.0;
  double elevation_deg = -25.0;
};

/// A camera of the model, by its name.
struct NamedCamera {
  std::string name;
};

using Camera = std::variant<FreeCamera, NamedCamera>;

/// Pinhole: u = fx x / z + cx, v = fy y / z + cy with x to the right, y down, z forward from the camera.
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  Pose world_T_camera = Pose::Identity();  ///< x right, y down, z forward
};

/// Depth, and the number of the geom that is seen at each pixel, rows from the top.
struct SurfaceImage {
  DepthImage depth;
  std::vector<int> geom;
};

struct RendererOptions {
  int width = 1280;
  int height = 720;
  int samples = 4;  ///< of multi-sample anti-aliasing, colour only: averaged depth is wrong at edges
  bool shadows = true;
  int shadow_resolution = 2048;  ///< pixels a side of the shadow map; 8192 for stills
};

/// Pictures of a model without a screen (EGL, surfaceless; software rendering where there is no GPU).
/// A renderer may move between threads, but only one may use it at a time; several may exist.
class Renderer {
 public:
  /// `model`: of a scene, the `drawn_model`. Throws InputError when EGL is not there or cannot make a context.
  explicit Renderer(std::shared_ptr<const mjModel> model, const RendererOptions& options = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Kinematics in `data` must be up to date (after mj_forward, mj_step or mj_kinematics with mj_camlight).
  /// Throws InputError for a camera that the model does not have.
  Image Color(mjData& data, const Camera& camera);
  /// Metres along the optical axis; beyond the far plane: the far plane. Rendered without multi-sampling.
  DepthImage Depth(mjData& data, const Camera& camera);
  /// What each pixel shows: the depth, and the geom of the model, -1 where there is none.
  SurfaceImage Surface(mjData& data, const Camera& camera);
  /// Projection and pose that Color and Depth have for this camera.
  CameraModel Model(mjData& data, const Camera& camera);

  const RendererOptions& options() const { return options_; }

 private:
  class Context;
  std::shared_ptr<const mjModel> model_;
  RendererOptions options_;
  std::unique_ptr<Context> context_;
};

/// The same for a camera of the model without rendering, in double precision. Kinematics and cameras in `data` must be
/// up to date (mj_camlight).
CameraModel CameraModelOf(const mjModel& model, const mjData& data, int camera, int width, int height);

/// Views that suit any task: the whole arm over its target, and tool and target from near.
FreeCamera OverviewCamera(const Scene& scene);
FreeCamera CloseUpCamera(const Scene& scene);

/// Which view of a scene.
enum class SceneView { kOverview, kCloseUp };

/// One picture of a scene with the tool at `world_T_tool` over the nominal target. Throws InputError when the pose is
/// out of reach.
Image RenderSceneImage(const Scene& scene, const Pose& world_T_tool, SceneView view = SceneView::kOverview,
                       const RendererOptions& options = {});
/// The same at the task's start pose.
Image RenderSceneImage(const Scene& scene, SceneView view = SceneView::kOverview, const RendererOptions& options = {});

}  // namespace feeler::env
