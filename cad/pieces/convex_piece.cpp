#include "feeler/cad/pieces/convex_piece.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <unordered_map>
#include <utility>

#include "feeler/cad/mesh/mesh_tree.h"

namespace feeler::cad {
namespace {

/// Qhull's tolerances suit numbers about 1.
constexpr double kScale = 1e3;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// Facets of the hull as triples of input points, and their planes (unscaled); false when the points are flat.
bool RunQhull(std::vector<double>& coordinates, std::vector<std::array<int, 3>>& triangles,
              std::vector<HalfSpace>& planes) {
  const std::unique_ptr<std::FILE, CloseFile> silence(std::fopen("/dev/null", "w"));
  qhT context;
  qhT* qh = &context;
  qh_zero(qh, silence.get());
  char options[] = "qhull Qt Pp";
  const int count = static_cast<int>(coordinates.size() / 3);
  const int error = qh_new_qhull(qh, 3, count, coordinates.data(), False, options, nullptr, silence.get());
  if (error == 0) {
    facetT* facet = nullptr;
    FORALLfacets {
      std::array<int, 3> corners{};
      std::size_t k = 0;
      vertexT* vertex = nullptr;
      vertexT** vertexp = nullptr;
      FOREACHvertex_(facet->vertices) {
        if (k < 3) corners[k++] = qh_pointid(qh, vertex->point);
      }
      if (facet->toporient ^ qh_ORIENTclock) std::swap(corners[0], corners[1]);
      triangles.push_back(corners);
      planes.push_back({{facet->normal[0], facet->normal[1], facet->normal[2]}, -facet->offset / kScale});
    }
  }
  qh_freeqhull(qh, !qh_ALL);
  int current = 0;
  int total = 0;
  qh_memfreeshort(qh, &current, &total);
  return error == 0;
}

/// One plane for each direction.
std::vector<HalfSpace> Distinct(const std::vector<HalfSpace>& planes) {
  constexpr double kBin = 1e-6;  // of a normal's x: far more than what planes of one face differ by
  std::unordered_map<std::int64_t, std::vector<std::size_t>> bins;
  std::vector<HalfSpace> distinct;
  for (const HalfSpace& plane : planes) {
    const auto bin = static_cast<std::int64_t>(std::floor(plane.normal.x() / kBin));
    std::size_t known = distinct.size();
    for (const std::int64_t near : {bin - 1, bin, bin + 1}) {
      const auto found = bins.find(near);
      if (found == bins.end()) continue;
      for (const std::size_t k : found->second) {
        const HalfSpace& other = distinct[k];
        if ((other.normal - plane.normal).squaredNorm() <= 1e-18 && std::abs(other.offset_m - plane.offset_m) <= 1e-9)
          known = std::min(known, k);
      }
    }
    if (known < distinct.size()) {
      distinct[known].offset_m = std::max(distinct[known].offset_m, plane.offset_m);
      continue;
    }
    bins[bin].push_back(distinct.size());
    distinct.push_back(plane);
  }
  return distinct;
}

}  // namespace

std::optional<ConvexPiece> HullOf(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < 4) return std::nullopt;
  Box box;
  for (const Eigen::Vector3d& p : points) box.extend(p);
  if (box.sizes().minCoeff() < 1e-7) return std::nullopt;
  const Eigen::Vector3d center = box.center();
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Eigen::Vector3d& p : points) {
    for (int k = 0; k < 3; ++k) coordinates.push_back((p[k] - center[k]) * kScale);
  }
  std::vector<std::array<int, 3>> triangles;
  ConvexPiece piece;
  std::vector<HalfSpace> planes;
  if (!RunQhull(coordinates, triangles, planes)) return std::nullopt;
  for (HalfSpace& plane : planes) plane.offset_m += plane.normal.dot(center);
  piece.planes = Distinct(planes);
  std::vector<int> number(points.size(), -1);
  for (const auto& t : triangles) {
    std::array<int, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      int& known = number[static_cast<std::size_t>(t[k])];
      if (known < 0) {
        known = static_cast<int>(piece.surface.points.size());
        piece.surface.points.push_back(points[static_cast<std::size_t>(t[k])]);
      }
      corners[k] = known;
    }
    piece.surface.triangles.push_back(corners);
  }
  piece.volume = VolumeOf(piece.surface);
  piece.bounds = BoundsOf(piece.surface);
  if (piece.volume < 1e-15) return std::nullopt;
  return piece;
}

ConvexPiece WithFewerCorners(const ConvexPiece& piece,
                             const std::function<double(const Eigen::Vector3d&)>& tolerance_at) {
  const std::vector<Eigen::Vector3d>& points = piece.surface.points;
  std::vector<bool> kept(points.size(), false);
  const auto keep_farthest = [&](const Eigen::Vector3d& way) {
    const auto farther = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return way.dot(a) < way.dot(b); };
    kept[static_cast<std::size_t>(std::max_element(points.begin(), points.end(), farther) - points.begin())] = true;
  };
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x != 0 || y != 0 || z != 0) keep_farthest(Eigen::Vector3d(x, y, z));
      }
    }
  }
  bool faces_agree = false;
  while (true) {
    std::vector<Eigen::Vector3d> some;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (kept[i]) some.push_back(points[i]);
    }
    std::optional<ConvexPiece> hull = HullOf(some);
    if (!hull) return piece;
    // Of what stands out over each face that which does so farthest, in shares of its tolerance.
    std::vector<std::pair<double, std::size_t>> worst(hull->planes.size(), {1.0, points.size()});
    bool any = false;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (kept[i]) continue;
      double out = 0;
      std::size_t over = 0;
      for (std::size_t k = 0; k < hull->planes.size(); ++k) {
        const double above = hull->planes[k].normal.dot(points[i]) - hull->planes[k].offset_m;
        if (above > out) {
          out = above;
          over = k;
        }
      }
      if (out <= 0.0) continue;
      double share = out / tolerance_at(points[i]);
      // Beyond an edge the piece is farther away than any of its faces; that takes long to tell, and is asked last.
      if (faces_agree && share <= 1.0) share = DistanceTo(*hull, points[i]) / tolerance_at(points[i]);
      if (share <= worst[over].first) continue;
      worst[over] = {share, i};
      any = true;
    }
    if (!any && faces_agree) return *std::move(hull);
    faces_agree = !any;
    for (const auto& [share, point] : worst) {
      if (point < points.size()) kept[point] = true;
    }
  }
}

double DistanceTo(const ConvexPiece& piece, const Eigen::Vector3d& point) {
  double above = -std::numeric_limits<double>::infinity();
  for (const HalfSpace& plane : piece.planes) above = std::max(above, plane.normal.dot(point) - plane.offset_m);
  if (above <= 0) return 0;
  double best = std::numeric_limits<double>::infinity();
  for (int t = 0; t < piece.surface.size(); ++t) {
    // A triangle is no nearer than its plane.
    const Eigen::Vector3d& corner = piece.surface.Corner(t, 0);
    const Eigen::Vector3d normal = (piece.surface.Corner(t, 1) - corner).cross(piece.surface.Corner(t, 2) - corner);
    const double over = normal.dot(point - corner);
    if (over * over >= best * normal.squaredNorm()) continue;
    const Eigen::Vector3d q =
        ClosestOnTriangle(point, piece.surface.Corner(t, 0), piece.surface.Corner(t, 1), piece.surface.Corner(t, 2));
    best = std::min(best, (point - q).squaredNorm());
  }
  return std::sqrt(best);
}

bool IsAlignedBox(const ConvexPiece& piece) {
  return piece.surface.points.size() == 8 && std::abs(piece.bounds.volume() - piece.volume) < 1e-7 * piece.volume;
}

}  // namespace feeler::cad
