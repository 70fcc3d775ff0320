#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/perception/nearest_points.h"
#include "feeler/perception/point_cloud.h"
#include "feeler/perception/registration.h"

namespace feeler::perception {

/// What a pose of the target is fitted to, at one level of detail. References; copy it freely while they live.
struct IcpFit {
  const Points& scene;  ///< in the world, thinned to `scene_spacing_m`
  const NearestPoints& scene_tree;
  const TargetModel::Level& model;
  const RegistrationOptions& options;
  const Eigen::Vector3d& eye_m;  ///< in the world
  double scene_spacing_m;
};

/// Indices of the model's points that an eye at `eye_m` (in the frame of the target) sees: they face it and are not
/// behind others of them.
std::vector<std::size_t> Visible(const TargetModel::Level& model, const Eigen::Vector3d& eye_m);

/// Moves `world_T_target` onto the scene: Gauss-Newton over the position and the turns about
/// `options.rotation_axes`, with pairs gated at `gate_m`, shrinking to `last_gate_m` over the first half of the
/// iterations. Only the part of the model that the eye sees is matched; it is determined at the start and half-way.
void Refine(const IcpFit& fit, double gate_m, double last_gate_m, int iterations, Pose& world_T_target);

/// As in Registration.
struct FitQuality {
  double fitness = 0.0;
  double explained = 0.0;
  double rms_m = 0.0;
};
/// `covariance`, if not null, is that of Registration.
FitQuality Judge(const IcpFit& fit, const Pose& world_T_target, Eigen::MatrixXd* covariance = nullptr);

}  // namespace feeler::perception
