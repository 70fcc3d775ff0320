#include "feeler/cad/measure/deviation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>

#include "feeler/cad/measure/sliding.h"
#include "feeler/cad/pieces/clip.h"
#include "feeler/cad/pieces/piece_union.h"
#include "feeler/core/random.h"

namespace feeler::cad {
namespace {

/// What must be cut up further than this has a bound that is good enough.
constexpr int kMostPatches = 400'000;

struct Patch {
  std::array<Eigen::Vector3d, 3> corners;
  double bound = 0.0;
  bool operator<(const Patch& other) const { return bound < other.bound; }
};

struct Best {
  double value = 0.0;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  void Offer(double v, const Eigen::Vector3d& p) {
    if (v > value) {
      value = v;
      at = p;
    }
  }
};

std::array<std::array<Eigen::Vector3d, 3>, 2> Halves(const std::array<Eigen::Vector3d, 3>& t) {
  std::size_t longest = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if ((t[(k + 1) % 3] - t[k]).squaredNorm() > (t[(longest + 1) % 3] - t[longest]).squaredNorm()) longest = k;
  }
  const Eigen::Vector3d& a = t[longest];
  const Eigen::Vector3d& b = t[(longest + 1) % 3];
  const Eigen::Vector3d& c = t[(longest + 2) % 3];
  const Eigen::Vector3d middle = 0.5 * (a + b);
  return {{{a, middle, c}, {middle, b, c}}};
}

/// Whether some triangle of the part cuts the patch.
bool SurfaceCuts(const MeshTree& part, const std::array<Eigen::Vector3d, 3>& patch) {
  Box box(patch[0]);
  box.extend(patch[1]);
  box.extend(patch[2]);
  bool cuts = false;
  part.Visit(box, [&](int t) {
    const TriangleMesh& mesh = part.mesh();
    cuts = TrianglesCut(patch, {mesh.Corner(t, 0), mesh.Corner(t, 1), mesh.Corner(t, 2)});
    return !cuts;
  });
  return cuts;
}

/// A face of a piece, moved inward by `depth_m` and away from the other faces by as much: so that a face that lies on
/// the surface of the part, or ends at it, does not cut it.
Polygon3 Shrunk(const ConvexPiece& piece, int triangle, double depth_m) {
  const Eigen::Vector3d area = AreaVector(piece.surface, triangle);
  if (area.norm() < 1e-16) return {};
  const Eigen::Vector3d inward = -area.normalized();
  Polygon3 polygon;
  for (int k = 0; k < 3; ++k) polygon.emplace_back(piece.surface.Corner(triangle, k) + depth_m * inward);
  Polygon3 shrunk = polygon;
  for (const HalfSpace& plane : piece.planes) {
    if (plane.normal.dot(inward) < -1 + 1e-9) continue;  // its own
    if (!IsWithin(shrunk, plane, -depth_m)) shrunk = Clip(shrunk, plane.normal, plane.offset_m - depth_m);
  }
  return shrunk.empty() ? polygon : shrunk;
}

/// What of a convex polygon may be farther from the part than `enough_m`: all but what lies over a triangle of the part
/// that is no farther from its corners. The distance to a triangle is a convex function.
std::vector<Polygon3> FarFrom(const MeshTree& part, const Polygon3& polygon, double enough_m) {
  constexpr double kOver_m = 1e-9;
  constexpr std::size_t kMostParts = 200;  // then patches do as well
  Box box;
  for (const Eigen::Vector3d& p : polygon) box.extend(p);
  std::vector<Polygon3> rest{polygon};
  part.Visit(Box(box.min().array() - enough_m, box.max().array() + enough_m), [&](int t) {
    const TriangleMesh& mesh = part.mesh();
    const Eigen::Vector3d area = AreaVector(mesh, t);
    if (area.norm() < 1e-16) return true;
    const std::array<Eigen::Vector3d, 3> corners{mesh.Corner(t, 0), mesh.Corner(t, 1), mesh.Corner(t, 2)};
    ConvexPiece over;  // the prism over the triangle, of its sides alone
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d normal = (corners[(k + 1) % 3] - corners[k]).cross(area).normalized();
      over.planes.push_back({normal, normal.dot(corners[k])});
    }
    const auto is_near = [&](const Eigen::Vector3d& p) {
      return (p - ClosestOnTriangle(p, corners[0], corners[1], corners[2])).norm() <= enough_m;
    };
    std::vector<Polygon3> next;
    for (Polygon3& one : rest) {
      const Polygon3 within = ClipToPiece(one, over, kOver_m);
      if (within.empty() || !std::all_of(within.begin(), within.end(), is_near)) {
        next.push_back(std::move(one));
        continue;
      }
      for (Polygon3& outside : Outside(one, over, kOver_m)) next.push_back(std::move(outside));
    }
    rest = std::move(next);
    return !rest.empty() && rest.size() < kMostParts;
  });
  return rest;
}

/// The farthest that the faces of the pieces stand out of the part.
Best Added(const MeshTree& part, const std::vector<ConvexPiece>& pieces, const std::optional<Box>& zone,
           double accuracy_m) {
  Best best;
  std::priority_queue<Patch> queue;
  const auto judge = [&](Patch patch) {
    const Eigen::Vector3d center = (patch.corners[0] + patch.corners[1] + patch.corners[2]) / 3;
    double radius = 0;
    for (const Eigen::Vector3d& corner : patch.corners) radius = std::max(radius, (corner - center).norm());
    const bool inside = part.Inside(center);
    if (inside && !SurfaceCuts(part, patch.corners)) return;
    const double here = inside ? 0.0 : part.Distance(center);
    best.Offer(here, center);
    patch.bound = here + radius;
    if (patch.bound > best.value + accuracy_m) queue.push(patch);
  };
  // First the middles of the faces: what they say lets most of the rest go.
  std::vector<Patch> faces;
  for (const ConvexPiece& piece : pieces) {
    for (int t = 0; t < piece.surface.size(); ++t) {
      Polygon3 polygon = Shrunk(piece, t, accuracy_m);
      if (zone) polygon = ClipToBox(std::move(polygon), *zone);
      for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
        const Patch patch{{polygon[0], polygon[k], polygon[k + 1]}, 0};
        const Eigen::Vector3d center = (patch.corners[0] + patch.corners[1] + patch.corners[2]) / 3;
        const bool inside = part.Inside(center);
        if (inside && !SurfaceCuts(part, patch.corners)) continue;
        if (!inside) best.Offer(part.Distance(center), center);
        faces.push_back(patch);
      }
    }
  }
  for (const Patch& face : faces) {
    const Polygon3 polygon(face.corners.begin(), face.corners.end());
    for (const Polygon3& rest : FarFrom(part, polygon, best.value + accuracy_m)) {
      for (std::size_t k = 1; k + 1 < rest.size(); ++k) judge({{rest[0], rest[k], rest[k + 1]}, 0});
    }
  }
  for (int cut = 0; cut < kMostPatches && !queue.empty(); ++cut) {
    const Patch patch = queue.top();
    queue.pop();
    if (patch.bound <= best.value + accuracy_m) break;
    for (const auto& half : Halves(patch.corners)) judge({half, 0});
  }
  if (!queue.empty() && queue.top().bound > best.value + accuracy_m) best.value = queue.top().bound;
  if (best.value > 0) best.value += accuracy_m;
  return best;
}

/// What pieces, grown by `grow_m`, leave uncovered of a triangle.
std::vector<Polygon3> Uncovered(const Polygon3& triangle, const std::vector<ConvexPiece>& pieces, double grow_m) {
  Box box;
  for (const Eigen::Vector3d& p : triangle) box.extend(p);
  const Box grown(box.min().array() - 2 * grow_m, box.max().array() + 2 * grow_m);
  std::vector<Polygon3> rest{triangle};
  for (const ConvexPiece& piece : pieces) {
    if (!piece.bounds.intersects(grown)) continue;
    std::vector<Polygon3> next;
    for (const Polygon3& polygon : rest) {
      for (Polygon3& outside : Outside(polygon, piece, grow_m)) next.push_back(std::move(outside));
    }
    rest = std::move(next);
    if (rest.empty()) break;
  }
  return rest;
}

/// The farthest that the part's surface is from the pieces: first at its corners, then what lies between them, as far
/// as some piece alone does not tell that it is no farther (PieceUnion::LargestFromOne).
class Losses {
 public:
  Losses(const std::vector<ConvexPiece>& pieces, double accuracy_m)
      : pieces_(pieces), union_(pieces), accuracy_m_(accuracy_m) {}

  Best Of(const TriangleMesh& mesh, const std::optional<Box>& zone) {
    std::vector<Polygon3> faces;
    for (int t = 0; t < mesh.size(); ++t) {
      Polygon3 face{mesh.Corner(t, 0), mesh.Corner(t, 1), mesh.Corner(t, 2)};
      if (zone) face = ClipToBox(std::move(face), *zone);
      if (face.size() < 3) continue;
      for (const Eigen::Vector3d& corner : face) Offer(corner);
      faces.push_back(std::move(face));
    }
    for (const Polygon3& face : faces) {
      const double enough_m = best_.value + accuracy_m_;
      if (union_.LargestFromOne(face, std::numeric_limits<double>::infinity()) <= enough_m) continue;
      for (const Polygon3& rest : Uncovered(face, pieces_, accuracy_m_)) {
        for (std::size_t k = 1; k + 1 < rest.size(); ++k) Judge({{rest[0], rest[k], rest[k + 1]}, 0});
      }
    }
    for (int cut = 0; cut < kMostPatches && !queue_.empty(); ++cut) {
      const Patch patch = queue_.top();
      queue_.pop();
      if (patch.bound <= best_.value + accuracy_m_) break;
      for (const auto& half : Halves(patch.corners)) Judge({half, 0});
    }
    if (!queue_.empty() && queue_.top().bound > best_.value + accuracy_m_) best_.value = queue_.top().bound;
    return best_;
  }

 private:
  /// What is within the accuracy is taken for nothing: rounding, most of it.
  double Offer(const Eigen::Vector3d& p) {
    const double distance_m = union_.Distance(p);
    if (distance_m > accuracy_m_) best_.Offer(distance_m, p);
    return distance_m;
  }

  void Judge(Patch patch) {
    double radius = 0;
    const Eigen::Vector3d center = (patch.corners[0] + patch.corners[1] + patch.corners[2]) / 3;
    for (const Eigen::Vector3d& corner : patch.corners) {
      Offer(corner);
      radius = std::max(radius, (corner - center).norm());
    }
    patch.bound = Offer(center) + radius;
    if (patch.bound <= best_.value + accuracy_m_) return;
    patch.bound = union_.LargestFromOne({patch.corners.begin(), patch.corners.end()}, patch.bound);
    if (patch.bound > best_.value + accuracy_m_) queue_.push(patch);
  }

  const std::vector<ConvexPiece>& pieces_;
  PieceUnion union_;
  double accuracy_m_;
  Best best_;
  std::priority_queue<Patch> queue_;
};

/// Points drawn evenly on a surface.
template <class Visit>
void Sample(const TriangleMesh& mesh, int points, RandomStream& random, const Visit& visit) {
  std::vector<double> sums;
  double sum = 0;
  for (int t = 0; t < mesh.size(); ++t) sums.push_back(sum += AreaVector(mesh, t).norm());
  for (int i = 0; i < points; ++i) {
    const auto at = std::upper_bound(sums.begin(), sums.end(), random.Uniform(0.0, sum));
    const int t = static_cast<int>(std::min<std::ptrdiff_t>(at - sums.begin(), mesh.size() - 1));
    double u = random.Uniform(0.0, 1.0);
    double v = random.Uniform(0.0, 1.0);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Eigen::Vector3d& a = mesh.Corner(t, 0);
    visit(Eigen::Vector3d(a + u * (mesh.Corner(t, 1) - a) + v * (mesh.Corner(t, 2) - a)));
  }
}

}  // namespace

Deviation DeviationOf(const MeshTree& part, const std::vector<ConvexPiece>& pieces, const std::optional<Box>& zone,
                      double accuracy_m) {
  const Best added = Added(part, pieces, zone, accuracy_m);
  const Best lost = Losses(pieces, accuracy_m).Of(part.mesh(), zone);
  return {added.value, added.at, lost.value, lost.at};
}

Deviation SampledDeviation(const MeshTree& part, const std::vector<ConvexPiece>& pieces, int points, std::uint64_t seed,
                           const std::optional<Box>& zone) {
  Best added;
  Best lost;
  TriangleMesh faces;
  for (const ConvexPiece& piece : pieces) Append(piece.surface, faces);
  const MeshTree tree(faces);
  RandomStream random(seed, 0, "cad deviation");
  const auto counts = [&](const Eigen::Vector3d& p) { return !zone || zone->contains(p); };
  Sample(faces, points / 2, random, [&](const Eigen::Vector3d& p) {
    if (counts(p)) added.Offer(part.DistanceToSolid(p), p);
  });
  Sample(part.mesh(), points - points / 2, random, [&](const Eigen::Vector3d& p) {
    if (!counts(p)) return;
    const bool within = std::any_of(pieces.begin(), pieces.end(), [&](const ConvexPiece& piece) {
      return std::all_of(piece.planes.begin(), piece.planes.end(),
                         [&](const HalfSpace& plane) { return plane.normal.dot(p) <= plane.offset_m; });
    });
    if (!within) lost.Offer(tree.Distance(p), p);
  });
  return {added.value, added.at, lost.value, lost.at};
}

}  // namespace feeler::cad
