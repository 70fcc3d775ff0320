#include "feeler/perception/point_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "feeler/core/lattice_grid.h"

namespace feeler::perception {
namespace {

using Key = std::array<std::int64_t, 3>;

/// Indices of the points, those of a cube next to each other, cubes in order; ties in order of the points' own place.
std::vector<std::pair<Key, std::size_t>> ByCube(const Points& points, double cell_m) {
  std::vector<std::pair<Key, std::size_t>> order;
  order.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    order.emplace_back(CubeOf(points[i], cell_m), i);
  }
  const auto before = [&](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    const Eigen::Vector3d& p = points[a.second];
    const Eigen::Vector3d& q = points[b.second];
    return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
  };
  std::sort(order.begin(), order.end(), before);
  return order;
}

/// Calls `visit(first, last)` for the run of each cube.
template <class Visit>
void ForEachCube(const std::vector<std::pair<Key, std::size_t>>& order, const Visit& visit) {
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last < order.size() && order[last].first == order[first].first) ++last;
    visit(first, last);
    first = last;
  }
}

/// Adds one point for each cube that holds any of `surface`.
void ThinInto(const SurfacePoints& surface, double cell_m, SurfacePoints& thinned) {
  const auto order = ByCube(surface.points, cell_m);
  ForEachCube(order, [&](std::size_t first, std::size_t last) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (std::size_t i = first; i < last; ++i) {
      sum += surface.points[order[i].second];
      normal += surface.normals[order[i].second];
    }
    constexpr double kCancelled = 0.9;  // of the number of points: an edge between two faces
    const auto count = static_cast<double>(last - first);
    if (normal.norm() < kCancelled * count) {
      thinned.points.push_back(surface.points[order[first].second]);
      thinned.normals.push_back(surface.normals[order[first].second]);
    } else {
      thinned.points.push_back(sum / count);
      thinned.normals.push_back(normal.normalized());
    }
  });
}

}  // namespace

Points Thinned(const Points& points, double cell_m) {
  const auto order = ByCube(points, cell_m);
  Points thinned;
  ForEachCube(order, [&](std::size_t first, std::size_t last) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = first; i < last; ++i) sum += points[order[i].second];
    thinned.push_back(sum / static_cast<double>(last - first));
  });
  return thinned;
}

SurfacePoints Thinned(const SurfacePoints& surface, double cell_m) {
  // Faces that look different ways are thinned apart: both faces of a plate thinner than a cube remain.
  std::array<SurfacePoints, 6> by_facing;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    Eigen::Index axis = 0;
    surface.normals[i].cwiseAbs().maxCoeff(&axis);
    SurfacePoints& group = by_facing[static_cast<std::size_t>(2 * axis) + (surface.normals[i][axis] < 0.0 ? 1 : 0)];
    group.points.push_back(surface.points[i]);
    group.normals.push_back(surface.normals[i]);
  }
  SurfacePoints thinned;
  for (const SurfacePoints& group : by_facing) ThinInto(group, cell_m, thinned);
  return thinned;
}

}  // namespace feeler::perception
