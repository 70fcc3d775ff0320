#include "feeler/cad/pieces/clip.h"

#include <algorithm>
#include <utility>

namespace feeler::cad {

Polygon3 Clip(const Polygon3& polygon, const Eigen::Vector3d& normal, double offset_m) {
  Polygon3 kept;
  const std::size_t count = polygon.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d& a = polygon[i];
    const Eigen::Vector3d& b = polygon[(i + 1) % count];
    const double ha = normal.dot(a) - offset_m;
    const double hb = normal.dot(b) - offset_m;
    if (ha <= 0) kept.push_back(a);
    if ((ha < 0 && hb > 0) || (ha > 0 && hb < 0)) kept.emplace_back(a + (b - a) * (ha / (ha - hb)));
  }
  return kept.size() < 3 ? Polygon3{} : kept;
}

bool IsWithin(const Polygon3& polygon, const HalfSpace& plane, double grow_m) {
  return std::all_of(polygon.begin(), polygon.end(),
                     [&](const Eigen::Vector3d& p) { return plane.normal.dot(p) - (plane.offset_m + grow_m) <= 0; });
}

namespace {

bool IsBeyond(const Polygon3& polygon, const HalfSpace& plane, double grow_m) {
  return std::all_of(polygon.begin(), polygon.end(),
                     [&](const Eigen::Vector3d& p) { return plane.normal.dot(p) - (plane.offset_m + grow_m) > 0; });
}

}  // namespace

Polygon3 ClipToPlanes(Polygon3 polygon, const std::vector<HalfSpace>& planes, double grow_m) {
  for (const HalfSpace& plane : planes) {
    if (IsBeyond(polygon, plane, grow_m)) return {};
  }
  for (const HalfSpace& plane : planes) {
    if (IsWithin(polygon, plane, grow_m)) continue;
    polygon = Clip(polygon, plane.normal, plane.offset_m + grow_m);
    if (polygon.empty()) break;
  }
  return polygon;
}

Polygon3 ClipToPiece(Polygon3 polygon, const ConvexPiece& piece, double grow_m) {
  return ClipToPlanes(std::move(polygon), piece.planes, grow_m);
}

std::vector<Polygon3> Outside(const Polygon3& polygon, const ConvexPiece& piece, double grow_m) {
  if (std::all_of(piece.planes.begin(), piece.planes.end(),
                  [&](const HalfSpace& plane) { return IsWithin(polygon, plane, grow_m); }))
    return {};
  if (ClipToPiece(polygon, piece, grow_m).empty()) return {polygon};
  std::vector<Polygon3> outside;
  Polygon3 rest = polygon;
  for (const HalfSpace& plane : piece.planes) {
    Polygon3 beyond = Clip(rest, -plane.normal, -(plane.offset_m + grow_m));
    if (!beyond.empty()) outside.push_back(std::move(beyond));
    rest = Clip(rest, plane.normal, plane.offset_m + grow_m);
    if (rest.empty()) break;
  }
  return outside;
}

Polygon3 ClipToBox(Polygon3 polygon, const Box& box) {
  for (int k = 0; k < 3 && !polygon.empty(); ++k) {
    polygon = Clip(polygon, Eigen::Vector3d::Unit(k), box.max()[k]);
    polygon = Clip(polygon, -Eigen::Vector3d::Unit(k), -box.min()[k]);
  }
  return polygon;
}

}  // namespace feeler::cad
