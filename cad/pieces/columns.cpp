#include "feeler/cad/pieces/columns.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "feeler/cad/pieces/clip.h"
#include "feeler/cad/section/convex_partition.h"

namespace feeler::cad {
namespace {

/// A face of the solid that lies in a side of a cell belongs to it.
constexpr double kOnSide_m = 1e-9;
/// Cells that no hull fits are halved so often.
constexpr int kHalvings = 5;

using Cell = std::vector<Eigen::Vector2d>;  ///< a convex polygon, counterclockwise

double OffLine(const SlabLoop& loop, const Eigen::Vector2d& p) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d& a = loop[i].middle;
    const Eigen::Vector2d side = loop[(i + 1) % loop.size()].middle - a;
    const double length = side.squaredNorm();
    const double share = length > 0 ? std::clamp((p - a).dot(side) / length, 0.0, 1.0) : 0.0;
    best = std::min(best, (p - a - share * side).squaredNorm());
  }
  return std::sqrt(best);
}

/// Whether one line lies within another, whichever way round they go; `slack_m` beyond it does not count.
bool LiesWithin(const SlabLoop& inner, const SlabLoop& outer, double slack_m) {
  const Eigen::AlignedBox2d a = BoundsOf(inner);
  const Eigen::AlignedBox2d b = BoundsOf(outer);
  if ((a.min().array() < b.min().array() - slack_m).any() || (a.max().array() > b.max().array() + slack_m).any())
    return false;
  return std::all_of(
             inner.begin(), inner.end(),
             [&](const SlabPoint& p) { return Encloses(outer, p.middle) || OffLine(outer, p.middle) <= slack_m; }) &&
         std::all_of(outer.begin(), outer.end(), [&](const SlabPoint& p) {
           return !Encloses(inner, p.middle) || OffLine(inner, p.middle) <= slack_m;
         });
}

using Height = Eigen::Vector2d SlabPoint::*;

SlabLoop At(const SlabLoop& loop, Height height) {
  SlabLoop section = loop;
  for (SlabPoint& p : section) p.low = p.high = p.middle = p.*height;
  return section;
}

/// The convex hull of the corners of two lines (Andrew 1979), counterclockwise.
SlabLoop HullAround(const SlabLoop& a, const SlabLoop& b) {
  std::vector<Eigen::Vector2d> points;
  for (const SlabLoop* loop : {&a, &b}) {
    for (const SlabPoint& p : *loop) points.push_back(p.middle);
  }
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    return p.x() != q.x() ? p.x() < q.x() : p.y() < q.y();
  });
  std::vector<Eigen::Vector2d> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t base = hull.size();
    for (const Eigen::Vector2d& p : points) {
      const auto turns_right = [&] {
        const Eigen::Vector2d u = hull.back() - hull[hull.size() - 2];
        const Eigen::Vector2d v = p - hull.back();
        return u.x() * v.y() - u.y() * v.x() <= 0;
      };
      while (hull.size() >= base + 2 && turns_right()) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  SlabLoop loop;
  for (const Eigen::Vector2d& p : hull) loop.push_back({p, p, p});
  return loop;
}

/// What of a convex loop does not lie beyond a line through `a`.
SlabLoop WithoutBeyond(const SlabLoop& loop, const Eigen::Vector2d& a, const Eigen::Vector2d& beyond) {
  SlabLoop rest;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d& p = loop[i].middle;
    const Eigen::Vector2d& q = loop[(i + 1) % loop.size()].middle;
    const double at_p = beyond.dot(p - a);
    const double at_q = beyond.dot(q - a);
    if (at_p <= 0) rest.push_back(loop[i]);
    if ((at_p < 0 && at_q > 0) || (at_p > 0 && at_q < 0)) {
      const Eigen::Vector2d between = p + (q - p) * (at_p / (at_p - at_q));
      rest.push_back({between, between, between});
    }
  }
  return rest;
}

/// Widest outlines and narrowest holes of the slabs that were added.
class Envelope {
 public:
  Envelope(double slack_m, bool with_ends) : slack_m_(slack_m), with_ends_(with_ends) {}

  /// False, and as it was, where material of the slab would stand in a hole, or a hole would be lost.
  bool Add(const Slab& slab) {
    const Envelope before = *this;
    if (with_ends_ ? AddSection(slab, &SlabPoint::low) && AddSection(slab, &SlabPoint::middle) &&
                         AddSection(slab, &SlabPoint::high)
                   : AddSection(slab, &SlabPoint::middle))
      return true;
    outlines_ = before.outlines_;
    holes_ = before.holes_;
    return false;
  }

  /// Widens the outlines to points of the solid that lie beyond all of them by more than `allowed_m` says.
  template <class Allowed>
  void Cover(const std::vector<Eigen::Vector3d>& points, const Allowed& allowed_m) {
    std::vector<SlabLoop> beyond(outlines_.size());
    for (const Eigen::Vector3d& point : points) {
      const Eigen::Vector2d p = point.head<2>();
      double least = std::numeric_limits<double>::infinity();
      std::size_t nearest = 0;
      for (std::size_t i = 0; i < outlines_.size() && least > 0; ++i) {
        const double off = Encloses(outlines_[i], p) ? 0.0 : OffLine(outlines_[i], p);
        if (off < least) nearest = i;
        least = std::min(least, off);
      }
      if (std::isfinite(least) && least > allowed_m(point)) beyond[nearest].push_back({p, p, p});
    }
    for (std::size_t i = 0; i < outlines_.size(); ++i) {
      if (!beyond[i].empty()) outlines_[i] = HullAround(outlines_[i], beyond[i]);
    }
  }

  std::vector<SlabLoop> loops() const {
    std::vector<SlabLoop> all = outlines_;
    all.insert(all.end(), holes_.begin(), holes_.end());
    return all;
  }

 private:
  bool AddSection(const Slab& slab, Height height) {
    std::vector<SlabLoop> outlines;
    std::vector<SlabLoop> holes;
    for (const SlabLoop& loop : slab.loops) {
      SlabLoop section = At(loop, height);
      // A tip comes to a point.
      if (std::abs(SignedArea(section)) <= 1e-4 * std::abs(SignedArea(loop))) continue;
      (SignedArea(loop) > 0 ? outlines : holes).push_back(std::move(section));
    }
    if (outlines_.empty()) {
      outlines_ = std::move(outlines);
      holes_ = std::move(holes);
      return true;  // at a tip there is nothing yet
    }
    return Widen(outlines) && Narrow(outlines, holes);
  }

  bool Widen(const std::vector<SlabLoop>& outlines) {
    if (outlines.empty()) return true;
    if (outlines.size() != outlines_.size()) return false;
    for (const SlabLoop& section : outlines) {
      const auto meets = [&](const SlabLoop& known) {
        return LiesWithin(section, known, slack_m_) || LiesWithin(known, section, slack_m_);
      };
      const auto known = std::find_if(outlines_.begin(), outlines_.end(), meets);
      if (known != outlines_.end()) {
        if (!LiesWithin(section, *known, slack_m_)) *known = section;
      } else if (outlines_.size() == 1) {
        outlines_.front() = HullAround(outlines_.front(), section);
      } else {
        return false;
      }
    }
    return true;
  }

  bool Narrow(const std::vector<SlabLoop>& outlines, const std::vector<SlabLoop>& holes) {
    std::vector<bool> met(holes_.size(), false);
    for (const SlabLoop& section : holes) {
      bool found = false;
      for (std::size_t i = 0; i < holes_.size() && !found; ++i) {
        const bool within = LiesWithin(section, holes_[i], slack_m_);
        found = !met[i] && (within || LiesWithin(holes_[i], section, slack_m_));
        if (!found) continue;
        met[i] = true;
        if (within) holes_[i] = section;
      }
      for (std::size_t i = 0; i < holes_.size() && !found; ++i) {
        auto rest = met[i] ? std::nullopt : Trimmed(holes_[i], {section});
        found = rest && LiesWithin(*rest, section, slack_m_);
        if (!found) continue;
        met[i] = true;
        holes_[i] = *std::move(rest);
      }
      if (!found) return false;
    }
    std::vector<SlabLoop> all = outlines;
    all.insert(all.end(), holes.begin(), holes.end());
    for (std::size_t i = 0; i < holes_.size(); ++i) {
      if (met[i] || IsAir(holes_[i], all)) continue;  // open to the side it may be
      auto rest = Trimmed(holes_[i], all);
      if (!rest || !IsAir(*rest, all)) return false;
      holes_[i] = *std::move(rest);
    }
    return true;
  }

  /// A convex hole without what sides of other lines take away of it: where the facets of a bore are not quite parallel
  /// its lines at two heights have other corners, and neither lies in the other. Sides that would take much are not of
  /// its wall.
  std::optional<SlabLoop> Trimmed(const SlabLoop& hole, const std::vector<SlabLoop>& lines) const {
    const double most_m = 4 * slack_m_;
    SlabLoop rest = HullAround(hole, hole);
    if (!LiesWithin(rest, hole, slack_m_)) return std::nullopt;
    for (const SlabLoop& line : lines) {
      for (std::size_t i = 0; i < line.size(); ++i) {
        const Eigen::Vector2d& a = line[i].middle;
        const Eigen::Vector2d side = line[(i + 1) % line.size()].middle - a;
        if (side.norm() < kOnSide_m) continue;
        const Eigen::Vector2d inward = Eigen::Vector2d(-side.y(), side.x()).normalized();  // into the material
        double deepest_m = 0.0;
        for (const SlabPoint& p : rest) deepest_m = std::max(deepest_m, inward.dot(p.middle - a));
        if (deepest_m > 0.0 && deepest_m <= most_m) rest = WithoutBeyond(rest, a, inward);
      }
    }
    std::reverse(rest.begin(), rest.end());  // holes go clockwise
    return rest;
  }

  /// Whether no material stands in a hole.
  bool IsAir(const SlabLoop& hole, const std::vector<SlabLoop>& section) const {
    const auto off = [&](const Eigen::Vector2d& p) {
      double least = std::numeric_limits<double>::infinity();
      for (const SlabLoop& loop : section) least = std::min(least, OffLine(loop, p));
      return least;
    };
    for (const SlabLoop& loop : section) {
      for (const SlabPoint& p : loop) {
        if (Encloses(hole, p.middle) && OffLine(hole, p.middle) > slack_m_) return false;
      }
    }
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const SlabPoint& p : hole) {
      middle += p.middle / static_cast<double>(hole.size());
      if (IsMaterial(section, p.middle) && off(p.middle) > slack_m_) return false;
    }
    return !IsMaterial(section, middle);
  }

  double slack_m_;
  bool with_ends_;
  std::vector<SlabLoop> outlines_;
  std::vector<SlabLoop> holes_;
};

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
