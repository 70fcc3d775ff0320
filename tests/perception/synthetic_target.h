#pragma once

#include <cstdint>

#include "feeler/core/pose.h"
#include "feeler/perception/point_cloud.h"
#include "feeler/perception/registration.h"

namespace feeler::perception {

/// A plate of 300 x 240 mm with a housing of 80 x 50 x 40 mm off its middle: no symmetry. Origin on the housing's top.
SurfacePoints SyntheticSurface(double spacing_m);

/// What a camera at `eye_m` sees of it: faces turned to it, not behind the housing; every point displaced at random
/// (`sigma_m` per axis).
Points SyntheticScene(const Pose& world_T_target, const Eigen::Vector3d& eye_m, double sigma_m, std::uint64_t seed);

}  // namespace feeler::perception
