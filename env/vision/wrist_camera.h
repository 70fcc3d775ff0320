#pragma once

#include <mujoco/mujoco.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/random.h"
#include "feeler/core/robot.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/scene/scene.h"
#include "feeler/env/vision/renderer.h"

namespace feeler::env {

struct WristCameraOptions {
  int width = 640;
  int height = 480;
  int samples = 0;            ///< of multi-sample anti-aliasing: 4 cost three times as much and halve the final error
  bool shadows = false;       ///< they cost more than all else
  double noise_levels = 1.0;  ///< standard deviation of each colour of each pixel, of 255
};

/// The colour camera on the wrist of a scene's robot: what it sees of the target, and of the tool that is in its way.
/// One thread at a time; the scene is shared.
class WristCamera {
 public:
  /// Throws InputError when the machine cannot render or the scene has no wrist camera.
  explicit WristCamera(std::shared_ptr<const Scene> scene, const WristCameraOptions& options = {});

  /// A picture of a state of the scene's physics, with calibration. `noise` null: without noise.
  CameraView Look(const mjData& data, RandomStream* noise);
  /// Depth and geom (of the drawn model) of each of its pixels, without noise.
  SurfaceImage Surface(const mjData& data);
  /// Of each of its pixels, 1: the robot itself, its gripper or its tool.
  std::vector<std::uint8_t> OwnBody(const SurfaceImage& surface) const;

 private:
  std::shared_ptr<const Scene> scene_;
  WristCameraOptions options_;
  int camera_ = -1;
  Renderer renderer_;
  DataHandle drawn_;
};

}  // namespace feeler::env
