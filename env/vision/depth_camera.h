#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/scene/scene.h"
#include "feeler/env/vision/depth_noise.h"
#include "feeler/env/vision/image.h"
#include "feeler/env/vision/renderer.h"

namespace feeler::env {

struct DepthCameraOptions {
  std::string camera = kStaticCamera;  ///< of the scene's model
  int width = 640;
  int height = 576;
  double farthest_m = 5.0;  ///< no reading beyond, along the optical axis
};

/// What a depth camera delivers.
struct DepthCapture {
  DepthImage depth;   ///< metres along the optical axis, 0: no reading
  CameraModel model;  ///< as its user believes: the nominal pose, whatever the installation
};

/// A depth camera of a scene. One thread at a time; the scene is shared.
class DepthCamera {
 public:
  /// Throws InputError when the machine cannot render or the scene has no such camera.
  explicit DepthCamera(std::shared_ptr<const Scene> scene, const DepthCameraOptions& options = {});

  /// `data`: a state of the scene's physics (or of its drawn model); only positions are read.
  DepthCapture Exact(const mjData& data);
  /// The mean of `averaged_frames` frames (AddDepthNoise) from where the installation really stands. Same arguments
  /// and state of `random`, same bits.
  DepthCapture Noisy(const mjData& data, const DepthNoiseOptions& noise, const Installation& installation,
                     RandomStream& random, int averaged_frames = 1);

  /// What Noisy adds noise to: the exact view from where the installation stands.
  DepthView View(const mjData& data, const Installation& installation);
  /// The geom of the drawn model at each pixel of the last capture, -1: none. For tests and scoring.
  const std::vector<int>& geoms() const { return geoms_; }
  /// As the user believes.
  CameraModel Nominal(const mjData& data);

 private:
  std::shared_ptr<const Scene> scene_;
  DepthCameraOptions options_;
  int camera_ = -1;
  Renderer renderer_;
  DataHandle drawn_;
  std::vector<float> geom_albedo_;
  std::vector<int> geoms_;
};

/// Reflectance in the near infrared that is assumed of a drawn geom: between 0.08 and 0.93 with the brightness of its
/// colour. Textures are not looked at.
double AssumedAlbedo(const mjModel& model, int geom);

}  // namespace feeler::env
