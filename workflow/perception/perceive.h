#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "feeler/core/pose.h"
#include "feeler/core/task.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/scene/scene.h"
#include "feeler/env/vision/depth_camera.h"
#include "feeler/env/vision/depth_noise.h"
#include "feeler/perception/depth_file.h"
#include "feeler/perception/registration.h"
#include "feeler/perception/uncertainty_table.h"
#include "feeler/workflow/setup/placement_draw.h"

namespace feeler::workflow {

/// How a target is looked for.
struct PerceptionSettings {
  perception::CloudOptions cloud;
  perception::RegistrationOptions registration;  ///< its rotation axes are set from the task
  /// Where there is no picture without the target, points outside of this box (world) are background: the robot's
  /// surroundings, and the bench it stands on.
  Eigen::Vector3d lower_m{-1.3, -1.3, 0.008};
  Eigen::Vector3d upper_m{1.3, 1.3, 2.2};
  int averaged_frames = 10;
  double model_spacing_m = 0.0025;
};

/// As the table was made: so many frames a picture, and which matches are believed.
PerceptionSettings SettingsOf(const perception::UncertaintyTable& table);

/// Finds the target of a task in depth images and point clouds. Immutable; share it between threads.
class TargetFinder {
 public:
  explicit TargetFinder(const env::TaskModel& task_model, const PerceptionSettings& settings = {});

  /// `background`: the same camera's picture without the target, or null. Throws InputError if sizes differ.
  perception::Registration InDepth(const perception::DepthFrame& depth, const perception::CameraIntrinsics& camera,
                                   const perception::DepthFrame* background = nullptr) const;
  /// `scene` in the world, seen from `eye_m`.
  perception::Registration InCloud(const perception::Points& scene, const Eigen::Vector3d& eye_m) const;
  /// What InDepth registers: the points that are not background.
  perception::Points Foreground(const perception::DepthFrame& depth, const perception::CameraIntrinsics& camera,
                                const perception::DepthFrame* background) const;

  const perception::TargetModel& model() const { return model_; }
  const PerceptionSettings& settings() const { return settings_; }

 private:
  PerceptionSettings settings_;
  perception::TargetModel model_;
  Eigen::Matrix3d nominal_orientation_;
};

/// A depth camera's picture and what its user believes of the camera, as perception takes them.
perception::DepthFrame ToFrame(const env::DepthImage& image);
perception::CameraIntrinsics ToIntrinsics(const env::CameraModel& model);

/// What one look at the scene gave.
struct Sight {
  Pose world_T_true = Pose::Identity();
  int rejected = 0;         ///< places drawn before it that the robot cannot serve or the camera cannot see
  double distance_m = 0.0;  ///< of the true target from the camera
  perception::Registration registration;
  double cpu_s = 0.0;  ///< of the registration, from the depth image on
};

/// The simulated cell of a depth camera: the arm at home, a target somewhere. One per thread; scene and finder shared.
class CameraCell {
 public:
  /// Throws InputError when the machine cannot render.
  CameraCell(std::shared_ptr<const env::Scene> scene, std::shared_ptr<const TargetFinder> finder,
             const env::DepthNoiseOptions& noise = {});

  /// Draws a place of the target that the robot can serve and the camera sees: at most `farthest_m` away, its
  /// opening turned to the camera by at least `least_cosine`, and at least `least_seen` of what faces the camera in its
  /// picture and not hidden.
  PlacementDraw DrawPlacement(RandomStream& random);

  /// Photographs the target at `world_T_target` and registers it. `installation_key`: which camera stands there; its
  /// installation and its picture of the scene without target are drawn from (seed, installation_key) once.
  /// `random`: the noise of this picture.
  Sight Look(const Pose& world_T_target, std::uint64_t seed, std::uint64_t installation_key, RandomStream& random);

  /// The picture that the last Look registered, and the one without the target.
  const perception::DepthFrame& depth() const { return depth_; }
  const perception::DepthFrame& background() const { return *background_; }
  const perception::CameraIntrinsics& intrinsics() const { return intrinsics_; }
  const Eigen::Vector3d eye_m() const { return intrinsics_.world_T_camera.translation(); }

  double farthest_m = 2.0;
  double least_seen = 0.8;
  double least_cosine = 0.34;  ///< between the way out of the opening and the way to the camera: 70 degrees

 private:
  struct Cell {
    env::Installation installation;
    perception::DepthFrame background;
  };
  const Cell& CellFor(std::uint64_t seed, std::uint64_t installation_key);
  perception::DepthFrame Picture(const std::optional<Pose>& world_T_target, const env::Installation& installation,
                                 RandomStream& random);
  bool Sees(const Pose& world_T_target);

  std::shared_ptr<const env::Scene> scene_;
  std::shared_ptr<const TargetFinder> finder_;
  env::DepthNoiseOptions noise_;
  env::DepthCamera camera_;
  PlacementSampler placements_;
  env::DataHandle data_;
  std::map<std::pair<std::uint64_t, std::uint64_t>, Cell> cells_;
  perception::CameraIntrinsics intrinsics_;
  perception::DepthFrame depth_;
  const perception::DepthFrame* background_ = nullptr;
};

}  // namespace feeler::workflow
