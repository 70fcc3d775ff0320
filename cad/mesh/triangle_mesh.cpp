#include "feeler/cad/mesh/triangle_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <unordered_map>

#include "feeler/core/lattice_grid.h"

namespace feeler::cad {
namespace {

/// Finds points that were seen before within a tolerance, by the cubes of a grid.
class PointGrid {
 public:
  explicit PointGrid(double tolerance_m) : tolerance_m_(tolerance_m), cell_m_(4 * tolerance_m) {}

  /// The number of a point within the tolerance of `p`; a new one where there is none.
  int NumberOf(const Eigen::Vector3d& p, std::vector<Eigen::Vector3d>& points) {
    const auto low = CubeOf(p - Eigen::Vector3d::Constant(tolerance_m_), cell_m_);
    const auto high = CubeOf(p + Eigen::Vector3d::Constant(tolerance_m_), cell_m_);
    for (std::int64_t x = low[0]; x <= high[0]; ++x) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
          const auto found = cells_.find(Key(x, y, z));
          if (found == cells_.end()) continue;
          for (const int number : found->second) {
            if ((points[static_cast<std::size_t>(number)] - p).norm() <= tolerance_m_) return number;
          }
        }
      }
    }
    const int number = static_cast<int>(points.size());
    points.push_back(p);
    const auto [x, y, z] = CubeOf(p, cell_m_);
    cells_[Key(x, y, z)].push_back(number);
    return number;
  }

 private:
  static std::uint64_t Key(std::int64_t x, std::int64_t y, std::int64_t z) {
    const auto mix = [](std::uint64_t h) { return (h ^ (h >> 31)) * 0x9e3779b97f4a7c15ULL; };
    return mix(mix(mix(static_cast<std::uint64_t>(x)) + static_cast<std::uint64_t>(y)) + static_cast<std::uint64_t>(z));
  }

  double tolerance_m_;
  double cell_m_;
  std::unordered_map<std::uint64_t, std::vector<int>> cells_;
};

}  // namespace

Box BoundsOf(const TriangleMesh& mesh) {
  Box box;
  for (const Eigen::Vector3d& point : mesh.points) box.extend(point);
  return box;
}

Box BoundsOf(const TriangleMesh& mesh, int triangle) {
  Box box(mesh.Corner(triangle, 0));
  box.extend(mesh.Corner(triangle, 1));
  box.extend(mesh.Corner(triangle, 2));
  return box;
}

Eigen::Vector3d AreaVector(const TriangleMesh& mesh, int triangle) {
  const Eigen::Vector3d& a = mesh.Corner(triangle, 0);
  return (mesh.Corner(triangle, 1) - a).cross(mesh.Corner(triangle, 2) - a);
}

double VolumeOf(const TriangleMesh& mesh) {
  if (mesh.points.empty()) return 0;
  const Eigen::Vector3d origin = BoundsOf(mesh).center();
  double six = 0;
  for (int t = 0; t < mesh.size(); ++t) six += (mesh.Corner(t, 0) - origin).dot(AreaVector(mesh, t));
  return six / 6;
}

double AreaOf(const TriangleMesh& mesh) {
  double twice = 0;
  for (int t = 0; t < mesh.size(); ++t) twice += AreaVector(mesh, t).norm();
  return twice / 2;
}

TriangleMesh Transformed(const TriangleMesh& mesh, const Pose& pose) {
  TriangleMesh moved = mesh;
  for (Eigen::Vector3d& point : moved.points) point = pose * point;
  return moved;
}

TriangleMesh Scaled(const TriangleMesh& mesh, double factor) {
  TriangleMesh scaled = mesh;
  for (Eigen::Vector3d& point : scaled.points) point *= factor;
  return scaled;
}

void Append(const TriangleMesh& more, TriangleMesh& mesh) {
  const int offset = static_cast<int>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), more.points.begin(), more.points.end());
  for (const auto& t : more.triangles) mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
}

TriangleMesh Welded(const TriangleMesh& mesh, double tolerance_m) {
  TriangleMesh welded;
  PointGrid grid(tolerance_m);
  std::vector<int> number(mesh.points.size(), -1);
  for (const auto& triangle : mesh.triangles) {
    std::array<int, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto old = static_cast<std::size_t>(triangle[k]);
      if (number[old] < 0) number[old] = grid.NumberOf(mesh.points[old], welded.points);
      corners[k] = number[old];
    }
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    welded.triangles.push_back(corners);
  }
  return welded;
}

std::vector<TriangleMesh> ShellsOf(const TriangleMesh& mesh) {
  std::vector<int> parent(mesh.points.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[static_cast<std::size_t>(i)] != i) {
      auto& up = parent[static_cast<std::size_t>(i)];
      up = parent[static_cast<std::size_t>(up)];
      i = up;
    }
    return i;
  };
  for (const auto& t : mesh.triangles) {
    for (const int other : {t[1], t[2]}) {
      const int a = root(t[0]);
      const int b = root(other);
      parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  std::vector<TriangleMesh> shells;
  std::unordered_map<int, std::size_t> shell_of;
  std::vector<int> number(mesh.points.size(), -1);
  for (const auto& t : mesh.triangles) {
    const auto [found, added] = shell_of.try_emplace(root(t[0]), shells.size());
    if (added) shells.emplace_back();
    TriangleMesh& shell = shells[found->second];
    std::array<int, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      int& known = number[static_cast<std::size_t>(t[k])];
      if (known < 0) {
        known = static_cast<int>(shell.points.size());
        shell.points.push_back(mesh.points[static_cast<std::size_t>(t[k])]);
      }
      corners[k] = known;
    }
    shell.triangles.push_back(corners);
  }
  return shells;
}

}  // namespace feeler::cad
