#include "feeler/cad/pieces/decompose.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/pieces/columns.h"
#include "feeler/cad/pieces/stays_inside.h"
#include "feeler/cad/pieces/unite_pieces.h"
#include "feeler/cad/section/convex_partition.h"
#include "feeler/cad/section/section.h"

namespace feeler::cad {
namespace {

/// Corners whose heights differ by less stand at one level.
constexpr double kLevel_m = 2e-6;
/// Bodies narrower than this are left out: they are the rounding of the file, and MuJoCo refuses slivers.
constexpr double kSliver_m = 1.5e-6;

double ToleranceAt(const DecomposeOptions& options, const Eigen::Vector3d& p) {
  return options.mating.contains(p) ? options.tolerance_near_m : options.tolerance_far_m;
}

/// Area of the triangles that lie flat at a height, by level.
std::vector<double> FlatAreas(const TriangleMesh& mesh, const std::vector<double>& levels) {
  std::vector<double> areas(levels.size(), 0.0);
  for (int t = 0; t < mesh.size(); ++t) {
    const Box box = BoundsOf(mesh, t);
    if (box.sizes().z() > kLevel_m) continue;
    const auto at = std::lower_bound(levels.begin(), levels.end(), box.center().z() - kLevel_m);
    if (at == levels.end()) continue;
    areas[static_cast<std::size_t>(at - levels.begin())] += AreaVector(mesh, t).norm() / 2;
  }
  return areas;
}

/// The levels at which slabs begin and end: all of them, or, for a free form with more, those with flat faces and as
/// many others as there is room for, evenly.
std::vector<double> SlabLevels(const TriangleMesh& mesh, int most) {
  const std::vector<double> levels = LevelsOf(mesh, kLevel_m);
  if (static_cast<int>(levels.size()) <= most + 1) return levels;
  const std::vector<double> areas = FlatAreas(mesh, levels);
  const double total = std::accumulate(areas.begin(), areas.end(), 0.0);
  std::vector<double> kept{levels.front()};
  const double step = (levels.back() - levels.front()) / most;
  for (std::size_t i = 1; i + 1 < levels.size(); ++i) {
    if (areas[i] > 1e-3 * total || levels[i] - kept.back() >= step) kept.push_back(levels[i]);
  }
  kept.push_back(levels.back());
  return kept;
}

bool IsPrism(const Slab& slab) {
  for (const SlabLoop& loop : slab.loops) {
    for (const SlabPoint& p : loop) {
      if ((p.low - p.high).norm() > kLevel_m / 2) return false;
    }
  }
  return true;
}

bool SameLoop(const SlabLoop& a, const SlabLoop& b, double tolerance_m) {
  if (a.size() != b.size()) return false;
  return std::all_of(a.begin(), a.end(), [&](const SlabPoint& p) {
    return std::any_of(b.begin(), b.end(),
                       [&](const SlabPoint& q) { return (p.middle - q.middle).norm() <= tolerance_m; });
  });
}

bool SameSection(const Slab& a, const Slab& b, double tolerance_m) {
  if (a.loops.size() != b.loops.size()) return false;
  return std::all_of(a.loops.begin(), a.loops.end(), [&](const SlabLoop& loop) {
    return std::any_of(b.loops.begin(), b.loops.end(),
                       [&](const SlabLoop& other) { return SameLoop(loop, other, tolerance_m); });
  });
}

/// The slabs of a solid, simplified within a share of the tolerances; prisms of one cross-section that follow each
/// other are one.
std::vector<Slab> SlabsOf(const TriangleMesh& solid, const DecomposeOptions& options, double share) {
  const std::vector<double> levels = SlabLevels(solid, options.most_slabs);
  std::vector<Slab> slabs;
  for (std::size_t i = 0; i + 1 < levels.size(); ++i) {
    Slab slab = SlabBetween(solid, levels[i], levels[i + 1]);
    const double height = 0.5 * (slab.low_m + slab.high_m);
    std::vector<SlabLoop> loops;
    for (const SlabLoop& loop : slab.loops) {
      SlabLoop simple = Simplified(loop, [&](const SlabPoint& p) {
        return share * ToleranceAt(options, {p.middle.x(), p.middle.y(), height});
      });
      if (simple.size() >= 3 && std::abs(SignedArea(simple)) > kSliver_m * kSliver_m)
        loops.push_back(std::move(simple));
    }
    slab.loops = std::move(loops);
    if (!slabs.empty() && IsPrism(slab) && IsPrism(slabs.back()) && SameSection(slab, slabs.back(), 2 * kLevel_m)) {
      slabs.back().high_m = slab.high_m;
      continue;
    }
    slabs.push_back(std::move(slab));
  }
  return slabs;
}

/// Width of a polygon across its narrowest side.
double Narrowest(const SlabLoop& loop) {
  double longest = 0;
  for (const SlabPoint& a : loop) {
    for (const SlabPoint& b : loop) longest = std::max(longest, (a.middle - b.middle).norm());
  }
  return longest > 0 ? SignedArea(loop) / longest : 0;
}

/// One half of a slab: the lower or the upper.
Slab HalfOf(const Slab& slab, bool upper) {
  const double middle = 0.5 * (slab.low_m + slab.high_m);
  Slab half{upper ? middle : slab.low_m, upper ? slab.high_m : middle, slab.loops};
  for (SlabLoop& loop : half.loops) {
    for (SlabPoint& p : loop) {
      (upper ? p.low : p.high) = p.middle;
      p.middle = 0.5 * (p.low + p.high);
    }
  }
  return half;
}

/// A convex polygon between two heights.
struct Body {
  SlabLoop polygon;
  double low_m = 0.0;
  double high_m = 0.0;
};

/// The convex bodies of a slab. Where no cut stays plane from end to end, its halves are cut, and their halves.
void CutSlab(const Slab& slab, double tolerance_m, int halvings, std::vector<Body>& bodies) {
  const auto polygons = ConvexPartition(slab.loops, tolerance_m, halvings > 0);
  if (!polygons) {
    CutSlab(HalfOf(slab, false), tolerance_m, halvings - 1, bodies);
    CutSlab(HalfOf(slab, true), tolerance_m, halvings - 1, bodies);
    return;
  }
  for (const SlabLoop& polygon : *polygons) {
    if (Narrowest(polygon) >= kSliver_m) bodies.push_back({polygon, slab.low_m, slab.high_m});
  }
}

/// Bodies as they come from below, where prisms that stand on each other are one.
class Prisms {
 public:
  void Add(Body body) {
    const auto key = KeyOf(body.polygon);
    if (key) {
      const auto [below, fresh] = last_.try_emplace(*key, bodies_.size());
      if (!fresh && bodies_[below->second].high_m == body.low_m) {
        bodies_[below->second].high_m = body.high_m;
        return;
      }
      below->second = bodies_.size();
    }
    bodies_.push_back(std::move(body));
  }

  const std::vector<Body>& bodies() const { return bodies_; }

 private:
  /// The corners of a prism, from the least on, as exactly as files give them; nothing for what is none.
  static std::optional<std::vector<std::int64_t>> KeyOf(const SlabLoop& polygon) {
    constexpr double kSame_m = 2.5e-7;  // coordinates in files are of 32 bits
    std::vector<std::array<std::int64_t, 2>> corners;
    for (const SlabPoint& p : polygon) {
      if ((p.low - p.high).norm() > kSame_m) return std::nullopt;
      corners.push_back({std::llround(p.middle.x() / kSame_m), std::llround(p.middle.y() / kSame_m)});
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    std::vector<std::int64_t> key;
    for (const auto& corner : corners) key.insert(key.end(), corner.begin(), corner.end());
    return key;
  }

  std::vector<Body> bodies_;
  std::map<std::vector<std::int64_t>, std::size_t> last_;  ///< the highest of each polygon
};

/// A number of convex polygons that none can be less than: one takes away two of the corners that stand in (Chazelle
/// and Dobkin, Optimal convex decompositions, 1985), a cut to a hole none that another could.
std::size_t LeastPolygons(const Slab& slab) {
  std::size_t standing_in = 0;
  for (const SlabLoop& loop : slab.loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector2d in = loop[i].middle - loop[(i + loop.size() - 1) % loop.size()].middle;
      const Eigen::Vector2d out = loop[(i + 1) % loop.size()].middle - loop[i].middle;
      if (in.x() * out.y() - in.y() * out.x() < 0) ++standing_in;
    }
  }
  return std::max<std::size_t>(1, standing_in / 2 - std::min(standing_in / 2, slab.loops.size()));
}

/// The bodies of all slabs; nothing where they are more than `most`.
std::optional<std::vector<ConvexPiece>> Elementary(const std::vector<Slab>& slabs, const DecomposeOptions& options,
                                                   std::size_t most) {
  constexpr int kMostHalvings = 6;
  std::size_t least = 0;
  for (const Slab& slab : slabs) least = std::max(least, LeastPolygons(slab));
  if (least > most) return std::nullopt;
  const double tolerance_m = 0.5 * std::min(options.tolerance_near_m, options.tolerance_far_m);
  Prisms prisms;
  for (const Slab& slab : slabs) {
    std::vector<Body> bodies;
    CutSlab(slab, tolerance_m, kMostHalvings, bodies);
    for (Body& body : bodies) prisms.Add(std::move(body));
    if (prisms.bodies().size() > most) return std::nullopt;
  }
  std::vector<ConvexPiece> pieces;
  for (const Body& body : prisms.bodies()) {
    std::vector<Eigen::Vector3d> corners;
    for (const SlabPoint& p : body.polygon) {
      corners.emplace_back(p.low.x(), p.low.y(), body.low_m);
      corners.emplace_back(p.high.x(), p.high.y(), body.high_m);
    }
    if (auto piece = HullOf(corners)) pieces.push_back(std::move(*piece));
  }
  return pieces;
}

}  // namespace

std::vector<ConvexPiece> Decompose(const TriangleMesh& solid, const DecomposeOptions& options) {
  constexpr std::size_t kAny = std::numeric_limits<std::size_t>::max();
  return *DecomposeIfFew(solid, options, kAny, kAny);
}

std::optional<std::vector<ConvexPiece>> DecomposeIfFew(const TriangleMesh& solid, const DecomposeOptions& options,
                                                       std::size_t most_bodies, std::size_t most_pieces) {
  const MeshTree tree(solid);
  if (auto hull = HullOf(solid.points); hull && StaysInside(*hull, tree, options))
    return std::vector<ConvexPiece>{std::move(*hull)};
  const int levels = static_cast<int>(LevelsOf(solid, kLevel_m).size());
  const bool free_form = levels > options.most_slabs + 1;
  constexpr std::size_t kAny = std::numeric_limits<std::size_t>::max();
  if (levels <= options.most_levels || most_pieces == kAny) {
    DecomposeOptions all_levels = options;
    if (most_pieces != kAny) all_levels.most_slabs = options.most_levels;
    if (auto bodies = Elementary(SlabsOf(solid, all_levels, 0.5), options, most_bodies)) {
      std::vector<ConvexPiece> pieces = United(std::move(*bodies), tree, options);
      if (pieces.size() <= most_pieces) return pieces;
    }
  }
  const std::vector<Slab> slabs = SlabsOf(solid, options, kSimplifiedShare);
  auto columns = ColumnsOf(slabs, !free_form, tree, options, std::min(most_bodies, 2 * most_pieces));
  if (!columns) return std::nullopt;
  std::vector<ConvexPiece> pieces = United(std::move(*columns), tree, options);
  if (pieces.size() > most_pieces) return std::nullopt;
  return pieces;
}

}  // namespace feeler::cad
