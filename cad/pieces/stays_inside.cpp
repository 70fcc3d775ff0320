#include "feeler/cad/pieces/stays_inside.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "feeler/cad/pieces/clip.h"

namespace feeler::cad {
namespace {

constexpr double kThinShare = 0.2;

/// How deep a surface may enter a hull. Of a thin hull nothing would be left to enter: it could close a hole.
struct Depths {
  double tight_m;  ///< anywhere
  double loose_m;  ///< outside of where the parts mate

  Depths(const ConvexPiece& hull, const DecomposeOptions& options) {
    const double thin = kThinShare * hull.bounds.sizes().minCoeff();
    loose_m = std::min(thin, std::max(options.tolerance_near_m, options.tolerance_far_m));
    tight_m = std::min({thin, options.tolerance_near_m, options.tolerance_far_m});
  }
};

using Planes = std::vector<HalfSpace>;

/// Of a hull's planes those that can cut what is in a box; nothing where one of them has all of the box outside.
std::optional<Planes> PlanesThrough(const Box& box, const Planes& planes, const Depths& depths) {
  const Eigen::Vector3d center = box.center();
  const Eigen::Vector3d half = 0.5 * box.sizes();
  Planes through;
  for (const HalfSpace& plane : planes) {
    const double at = plane.normal.dot(center) - plane.offset_m;
    const double reach = plane.normal.cwiseAbs().dot(half);
    if (at - reach > -0.9 * depths.tight_m) return std::nullopt;
    if (at + reach > -depths.loose_m) through.push_back(plane);
  }
  return through;
}

}  // namespace

bool IsThin(const ConvexPiece& hull, const DecomposeOptions& options) {
  return kThinShare * hull.bounds.sizes().minCoeff() < std::max(options.tolerance_near_m, options.tolerance_far_m);
}

bool StaysInside(const ConvexPiece& hull, const MeshTree& solid, const DecomposeOptions& options) {
  const Depths depths(hull, options);
  const TriangleMesh& mesh = solid.mesh();
  bool inside = true;
  const auto narrow = [&](const Box& box, const Planes& planes) { return PlanesThrough(box, planes, depths); };
  solid.boxes().DescendWith(hull.planes, narrow, [&](int t, const Planes& around) {
    const auto planes = narrow(BoundsOf(mesh, t), around);
    if (!planes) return true;
    const Polygon3 triangle{mesh.Corner(t, 0), mesh.Corner(t, 1), mesh.Corner(t, 2)};
    const Polygon3 entered = ClipToPlanes(triangle, *planes, -depths.tight_m);
    if (entered.empty()) return true;
    inside = depths.loose_m > depths.tight_m && ClipToPlanes(entered, *planes, -depths.loose_m).empty() &&
             ClipToBox(entered, options.mating).empty();
    return inside;
  });
  return inside;
}

}  // namespace feeler::cad
