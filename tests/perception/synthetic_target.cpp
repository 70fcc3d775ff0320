#include "tests/perception/synthetic_target.h"

#include <algorithm>
#include <cmath>

#include "feeler/core/random.h"

namespace feeler::perception {
namespace {

void AddBox(const Eigen::Vector3d& centre, const Eigen::Vector3d& half, double spacing_m, SurfacePoints& surface) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      for (double a = -half[u] + 0.5 * spacing_m; a < half[u]; a += spacing_m) {
        for (double b = -half[v] + 0.5 * spacing_m; b < half[v]; b += spacing_m) {
          Eigen::Vector3d point = centre;
          point[axis] += side * half[axis];
          point[u] += a;
          point[v] += b;
          surface.points.push_back(point);
          surface.normals.push_back(side * Eigen::Vector3d::Unit(axis));
        }
      }
    }
  }
}

const Eigen::Vector3d kHousing_m(0.0, 0.0, -0.02);
const Eigen::Vector3d kHousingHalf_m(0.04, 0.025, 0.02);

/// Whether the housing stands between the eye and a point, both in the target's frame.
bool BehindHousing(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& point_m) {
  double enter = 0.0;
  double leave = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double from = eye_m[axis] - kHousing_m[axis];
    const double along = point_m[axis] - eye_m[axis];
    if (std::abs(along) < 1e-12) {
      if (std::abs(from) > kHousingHalf_m[axis]) return false;
      continue;
    }
    const double a = (-kHousingHalf_m[axis] - from) / along;
    const double b = (kHousingHalf_m[axis] - from) / along;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  constexpr double kOnIt = 1e-6;
  return enter < leave && enter < 1.0 - kOnIt;
}

}  // namespace

SurfacePoints SyntheticSurface(double spacing_m) {
  SurfacePoints surface;
  AddBox({0.03, 0.02, -0.046}, {0.15, 0.12, 0.006}, spacing_m, surface);
  AddBox(kHousing_m, kHousingHalf_m, spacing_m, surface);
  return surface;
}

Points SyntheticScene(const Pose& world_T_target, const Eigen::Vector3d& eye_m, double sigma_m, std::uint64_t seed) {
  RandomStream random(seed, 0, "synthetic scene");
  const SurfacePoints surface = SyntheticSurface(0.004);
  Points scene;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const Eigen::Vector3d point = world_T_target * surface.points[i];
    if ((eye_m - point).dot(world_T_target.linear() * surface.normals[i]) < 0.1 * (eye_m - point).norm()) continue;
    if (BehindHousing(world_T_target.inverse() * eye_m, surface.points[i])) continue;
    scene.push_back(point + sigma_m * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()));
  }
  return scene;
}

}  // namespace feeler::perception
