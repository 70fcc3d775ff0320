#include "feeler/cad/pieces/columns.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "feeler/cad/pieces/clip.h"
#include "feeler/cad/pieces/envelope.h"
#include "feeler/cad/pieces/stays_inside.h"
#include "feeler/cad/section/convex_partition.h"

namespace feeler::cad {
namespace {

/// A face of the solid that lies in a side of a cell belongs to it.
constexpr double kOnSide_m = 1e-9;
/// Cells that no hull fits are halved so often.
constexpr int kHalvings = 5;

using Cell = std::vector<Eigen::Vector2d>;  ///< a convex polygon, counterclockwise

class Stacker {
 public:
  Stacker(const std::vector<Slab>& slabs, bool with_ends, const MeshTree& solid, const DecomposeOptions& options,
          std::size_t most)
      : slabs_(slabs), with_ends_(with_ends), solid_(solid), options_(options), most_(most) {}

  std::optional<std::vector<ConvexPiece>> Run() {
    const double tolerance_m = std::min(options_.tolerance_near_m, options_.tolerance_far_m);
    const double slack_m = 2 * kSimplifiedShare * tolerance_m;
    for (std::size_t first = 0; first < slabs_.size();) {
      Envelope envelope(slack_m, with_ends_);
      std::size_t last = first;
      while (last < slabs_.size() && envelope.Add(slabs_[last])) ++last;
      const bool is_alone = last == first;  // its own ends do not lie in each other
      if (is_alone) {
        envelope = Envelope(slack_m, false);
        envelope.Add(slabs_[first]);
        ++last;
      }
      // Middles alone do not tell what lies between them.
      if (is_alone || !with_ends_) {
        envelope.Cover(PointsBetween(slabs_[first].low_m, slabs_[last - 1].high_m), [&](const Eigen::Vector3d& p) {
          return options_.mating.contains(p) ? options_.tolerance_near_m : options_.tolerance_far_m;
        });
      }
      for (const SlabLoop& polygon :
           ConvexPartition(envelope.loops(), 0.5 * tolerance_m, false).value_or(std::vector<SlabLoop>{})) {
        Cell cell;  // convex: corners that stand in by little would each cut off much
        for (const SlabPoint& p : HullAround(polygon, polygon)) cell.push_back(p.middle);
        Stack(cell, first, last - 1, kHalvings);
        if (pieces_.size() > most_ || (is_rough_ && !options_.rough)) return std::nullopt;
      }
      first = last;
    }
    return std::move(pieces_);
  }

 private:
  /// The corners of the solid between two heights, and those of its sections there.
  std::vector<Eigen::Vector3d> PointsBetween(double low_m, double high_m) const {
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector3d& p : solid_.mesh().points) {
      if (p.z() >= low_m && p.z() <= high_m) points.push_back(p);
    }
    const double inward_m = std::min(1e-7, 0.25 * (high_m - low_m));  // off the faces that lie at the heights
    for (const double height : {low_m + inward_m, high_m - inward_m}) {
      for (const SlabLoop& loop : SectionAt(solid_.mesh(), height)) {
        for (const SlabPoint& p : loop) points.emplace_back(p.middle.x(), p.middle.y(), height);
      }
    }
    return points;
  }

  /// Hulls of as many slabs as may be, from the lowest up.
  void Stack(const Cell& cell, std::size_t first, std::size_t last, int halvings) {
    while (first <= last && pieces_.size() <= most_ && (!is_rough_ || options_.rough)) {
      std::size_t reached = first;
      std::optional<ConvexPiece> hull = HullOver(cell, first, last);
      if (!hull || StaysInside(*hull, solid_, options_)) {
        reached = last;
      } else {
        // The most of them that do, by halves: what stays inside does so with less.
        hull.reset();
        std::size_t low = first;
        std::size_t high = last;
        while (low < high) {
          const std::size_t between = low + (high - low) / 2;
          std::optional<ConvexPiece> some = HullOver(cell, first, between);
          if (some && !StaysInside(*some, solid_, options_)) {
            high = between;
            continue;
          }
          hull = std::move(some);
          reached = between;
          low = between + 1;
        }
        if (low == first) {
          Split(cell, first, halvings);
          ++first;
          continue;
        }
      }
      if (hull) pieces_.push_back(std::move(*hull));
      first = reached + 1;
    }
  }

  /// A slab over a cell for which one hull does not do: over its halves.
  void Split(const Cell& cell, std::size_t slab, int halvings) {
    if (halvings == 0) {
      is_rough_ = true;
      if (auto hull = HullOver(cell, slab, slab)) pieces_.push_back(std::move(*hull));
      return;
    }
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& p : cell) box.extend(p);
    Polygon3 flat;
    for (const Eigen::Vector2d& p : cell) flat.emplace_back(p.x(), p.y(), 0);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    for (const double sign : {1.0, -1.0}) {
      Cell half;
      for (const Eigen::Vector3d& p : Clip(flat, sign * Eigen::Vector3d::Unit(axis), sign * box.center()[axis]))
        half.emplace_back(p.head<2>());
      if (half.size() >= 3) Stack(half, slab, slab, halvings - 1);
    }
  }

  /// The hull of what of the solid is over a cell, in some slabs; nothing where there is none.
  std::optional<ConvexPiece> HullOver(const Cell& cell, std::size_t first, std::size_t last) const {
    ConvexPiece prism;
    const double low = slabs_[first].low_m;
    const double high = slabs_[last].high_m;
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < cell.size(); ++i) {
      const Eigen::Vector2d side = cell[(i + 1) % cell.size()] - cell[i];
      for (const double z : {low, high}) prism.bounds.extend(Eigen::Vector3d(cell[i].x(), cell[i].y(), z));
      if (side.norm() < kOnSide_m) continue;
      const Eigen::Vector3d normal = Eigen::Vector3d(side.y(), -side.x(), 0).normalized();
      prism.planes.push_back({normal, normal.head<2>().dot(cell[i])});
    }
    prism.planes.push_back({Eigen::Vector3d::UnitZ(), high});
    prism.planes.push_back({-Eigen::Vector3d::UnitZ(), -low});
    for (const Eigen::Vector2d& p : cell) {
      for (const double z : {low, high}) {
        if (solid_.Inside({p.x(), p.y(), z})) points.emplace_back(p.x(), p.y(), z);
      }
    }
    const Box reach(prism.bounds.min().array() - kOnSide_m, prism.bounds.max().array() + kOnSide_m);
    solid_.Visit(reach, [&](int t) {
      const TriangleMesh& mesh = solid_.mesh();
      for (const Eigen::Vector3d& p :
           ClipToPiece({mesh.Corner(t, 0), mesh.Corner(t, 1), mesh.Corner(t, 2)}, prism, kOnSide_m))
        points.push_back(p);
      return true;
    });
    return HullOf(points);
  }

  const std::vector<Slab>& slabs_;
  bool with_ends_;
  const MeshTree& solid_;
  const DecomposeOptions& options_;
  std::size_t most_;
  std::vector<ConvexPiece> pieces_;
  bool is_rough_ = false;  ///< some piece leaves the tolerances
};

}  // namespace

std::optional<std::vector<ConvexPiece>> ColumnsOf(const std::vector<Slab>& slabs, bool with_ends, const MeshTree& solid,
                                                  const DecomposeOptions& options, std::size_t most) {
  return Stacker(slabs, with_ends, solid, options, most).Run();
}

}  // namespace feeler::cad
