#include "tests/perception/synthetic_target.h"

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

}  // namespace

SurfacePoints SyntheticSurface(double spacing_m) {
  SurfacePoints surface;
  AddBox({0.03, 0.02, -0.046}, {0.15, 0.12, 0.006}, spacing_m, surface);
  AddBox({0.0, 0.0, -0.02}, {0.04, 0.025, 0.02}, spacing_m, surface);
  return surface;
}

Points SyntheticScene(const Pose& world_T_target, const Eigen::Vector3d& eye_m, double sigma_m, std::uint64_t seed) {
  RandomStream random(seed, 0, "synthetic scene");
  const SurfacePoints surface = SyntheticSurface(0.004);
  Points scene;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const Eigen::Vector3d point = world_T_target * surface.points[i];
    if ((eye_m - point).dot(world_T_target.linear() * surface.normals[i]) < 0.1 * (eye_m - point).norm()) continue;
    scene.push_back(point + sigma_m * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()));
  }
  return scene;
}

}  // namespace feeler::perception
