#include "feeler/cad/section/convex_partition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

namespace feeler::cad {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kTouch_m = 1e-9;
/// Reflex corners looked at as the other end of a cut.
constexpr std::size_t kMostPartners = 16;
/// A cut that ends this near to a corner ends at it.
constexpr double kSnap = 0.02;
/// Between a cut and a side, where there is a choice.
constexpr double kLeastAngle = kPi / 6;
/// A cut whose ends are off a plane by less, or by this share of the tolerance, is plane.
constexpr double kPlane_m = 2e-7;
constexpr double kPlaneShare = 0.5;
/// Of the directions that a cut may take, where the bisector and the prolonged sides do not do.
constexpr std::array kFan{1.0 / 6, 1.0 / 3, 0.5, 2.0 / 3, 5.0 / 6};

using Height = Eigen::Vector2d SlabPoint::*;
constexpr std::array<Height, 2> kEnds{&SlabPoint::low, &SlabPoint::high};

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Angle from `a` counterclockwise to `b`, 0 to 2 pi.
double Turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const double angle = std::atan2(Cross(a, b), a.dot(b));
  return angle < 0 ? angle + 2 * kPi : angle;
}

/// Material in one piece: the loop around it first, then its holes.
struct Region {
  std::vector<SlabLoop> loops;
};

struct Place {
  std::size_t loop = 0;
  std::size_t index = 0;
  double share = 0.0;  ///< of the side from `index` to the next corner; 0: the corner itself
};

struct Corner {
  Place place;
  Eigen::Vector2d at;
  Eigen::Vector2d to_next;  ///< directions, not unit
  Eigen::Vector2d to_previous;
  double angle = 0.0;  ///< of the material
};

Corner CornerAt(const Region& region, std::size_t loop, std::size_t index) {
  const SlabLoop& points = region.loops[loop];
  const std::size_t count = points.size();
  Corner corner{{loop, index, 0.0}, points[index].middle, {}, {}, 0.0};
  corner.to_next = points[(index + 1) % count].middle - corner.at;
  corner.to_previous = points[(index + count - 1) % count].middle - corner.at;
  corner.angle = Turn(corner.to_next, corner.to_previous);
  if (corner.angle < 1e-12) corner.angle = 2 * kPi;  // the end of a cut that stands in the material
  return corner;
}

/// How far the corner stands into the polygon beyond the line between its neighbours: what is lost if it is left.
bool IsReflex(const Region& region, const Corner& corner, double tolerance_m) {
  if (corner.angle <= kPi + 1e-9) return false;
  if (corner.angle > 1.5 * kPi) return true;
  const SlabLoop& loop = region.loops[corner.place.loop];
  const std::size_t count = loop.size();
  const SlabPoint& next = loop[(corner.place.index + 1) % count];
  const SlabPoint& previous = loop[(corner.place.index + count - 1) % count];
  const auto stands_in = [&](Height at) {
    const Eigen::Vector2d chord = next.*at - previous.*at;
    const double length = chord.norm();
    if (length < kTouch_m) return at == &SlabPoint::middle;
    return std::abs(Cross(chord, next.*at - loop[corner.place.index].*at)) / length > tolerance_m;
  };
  return stands_in(&SlabPoint::middle) || stands_in(&SlabPoint::low) || stands_in(&SlabPoint::high);
}

/// Which points are corners of the convex hull of a loop (Andrew 1979).
std::vector<bool> OnHull(const SlabLoop& loop, Height at) {
  std::vector<std::size_t> order(loop.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto point = [&](std::size_t i) -> const Eigen::Vector2d& { return loop[i].*at; };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Eigen::Vector2d& p = point(a);
    const Eigen::Vector2d& q = point(b);
    return p.x() != q.x() ? p.x() < q.x() : p.y() != q.y() ? p.y() < q.y() : a < b;
  });
  std::vector<bool> on_hull(loop.size(), false);
  for (int side = 0; side < 2; ++side) {
    std::vector<std::size_t> chain;
    for (const std::size_t i : order) {
      while (chain.size() >= 2) {
        const Eigen::Vector2d& last = point(chain.back());
        if (Cross(last - point(chain[chain.size() - 2]), point(i) - last) > 0) break;
        chain.pop_back();
      }
      chain.push_back(i);
    }
    for (const std::size_t i : chain) on_hull[i] = true;
    std::reverse(order.begin(), order.end());
  }
  return on_hull;
}

/// The corner that is deepest below its side of the loop's convex hull, where that is more than the tolerance. Along an
/// arc each corner may stand in by next to nothing, and all of them by much.
std::optional<std::size_t> Deepest(const SlabLoop& loop, double tolerance_m) {
  const std::size_t count = loop.size();
  double deepest_m = tolerance_m;
  std::optional<std::size_t> found;
  for (const Height at : {&SlabPoint::middle, &SlabPoint::low, &SlabPoint::high}) {
    const std::vector<bool> on_hull = OnHull(loop, at);
    const auto first = std::find(on_hull.begin(), on_hull.end(), true);
    if (first == on_hull.end()) continue;
    const auto start = static_cast<std::size_t>(first - on_hull.begin());
    for (std::size_t from = 0; from < count;) {
      std::size_t to = from + 1;
      while (to < count && !on_hull[(start + to) % count]) ++to;
      const Eigen::Vector2d& a = loop[(start + from) % count].*at;
      const Eigen::Vector2d side = loop[(start + to) % count].*at - a;
      for (std::size_t i = from + 1; i < to && side.norm() > kTouch_m; ++i) {
        const std::size_t corner = (start + i) % count;
        const double depth_m = Cross(side, loop[corner].*at - a) / side.norm();
        if (depth_m <= deepest_m) continue;
        deepest_m = depth_m;
        found = corner;
      }
      from = to;
    }
  }
  return found;
}

bool IsPrism(const Region& region) {
  return std::all_of(region.loops.begin(), region.loops.end(), [](const SlabLoop& loop) {
    return std::all_of(loop.begin(), loop.end(),
                       [](const SlabPoint& p) { return (p.low - p.high).norm() <= kTouch_m; });
  });
}

struct Cut {
  Place end;
  SlabPoint point;  ///< where it ends, if within a side
  double score = std::numeric_limits<double>::infinity();
};

struct Hit {
  Place place;
  double distance = std::numeric_limits<double>::infinity();
  Eigen::Vector2d side;  ///< direction of the side that was hit, unit
};

/// The first side that a ray through the material comes to.
Hit Shoot(const Region& region, const Eigen::Vector2d& from, const Eigen::Vector2d& direction,
          Height at = &SlabPoint::middle) {
  Hit hit;
  for (std::size_t l = 0; l < region.loops.size(); ++l) {
    const SlabLoop& loop = region.loops[l];
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector2d& a = loop[i].*at;
      const Eigen::Vector2d side = loop[i + 1 < loop.size() ? i + 1 : 0].*at - a;
      const double across = Cross(direction, side);
      if (across <= 0) continue;  // the ray leaves the material from a side's left to its right
      const double t_across = Cross(a - from, side);
      if (t_across <= kTouch_m * across || t_across >= hit.distance * across) continue;
      const double s = Cross(a - from, direction) / across;
      if (s < -1 || s > 2) continue;  // farther beside than any slack; lengths of sides cost more
      const double slack = kTouch_m / std::max(side.norm(), kTouch_m);
      if (s < -slack || s > 1 + slack) continue;
      hit = {{l, i, std::clamp(s, 0.0, 1.0)}, t_across / across, side.normalized()};
    }
  }
  return hit;
}

bool Within(const Corner& corner, const Eigen::Vector2d& direction) {
  const double angle = Turn(corner.to_next, direction);
  return angle > 1e-9 && angle < corner.angle - 1e-9;
}

bool IsOn(const SlabLoop& loop, const Eigen::Vector2d& point) {
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d& a = loop[i].middle;
    const Eigen::Vector2d side = loop[(i + 1) % loop.size()].middle - a;
    const double length = side.squaredNorm();
    const double share = length > 0 ? std::clamp((point - a).dot(side) / length, 0.0, 1.0) : 0.0;
    if ((point - a - share * side).norm() <= 2 * kTouch_m) return true;
  }
  return false;
}

/// Whether a hole lies in a loop; the two may have corners and sides in common, which tell nothing.
bool Holds(const SlabLoop& around, const SlabLoop& hole) {
  if (SignedArea(around) < -SignedArea(hole)) return false;
  for (std::size_t i = 0; i < hole.size(); ++i) {
    const Eigen::Vector2d& corner = hole[i].middle;
    const Eigen::Vector2d between = 0.5 * (corner + hole[(i + 1) % hole.size()].middle);
    for (const Eigen::Vector2d& point : {corner, between}) {
      if (!IsOn(around, point)) return Encloses(around, point);
    }
  }
  return true;
}

/// The part of the score that asks for cuts that meet sides squarely.
double Squareness(double angle) { return std::max(std::sin(std::clamp(angle, 0.0, kPi / 2)), 1e-3); }

class Cutter {
 public:
  Cutter(Region region, double tolerance_m, bool plane_only)
      : tolerance_m_(tolerance_m),
        plane_m_(std::max(kPlane_m, kPlaneShare * tolerance_m)),
        any_cut_does_(!plane_only || IsPrism(region)) {
    regions_.push_back(std::move(region));
  }

  /// False when a cut would not be plane.
  bool Run(std::vector<SlabLoop>& done) {
    while (!regions_.empty()) {
      Region region = std::move(regions_.back());
      regions_.pop_back();
      const bool convex = !CutOnce(region);
      if (!convex) continue;
      if (stuck_) return false;
      done.push_back(std::move(region.loops.front()));
    }
    return true;
  }

 private:
  /// False when the region is convex (or nothing can be done about it).
  bool CutOnce(Region& region) {
    std::vector<Corner> reflex;
    for (std::size_t l = 0; l < region.loops.size(); ++l) {
      for (std::size_t i = 0; i < region.loops[l].size(); ++i) {
        const Corner corner = CornerAt(region, l, i);
        // Every hole has to be opened, however small its corners are.
        if (IsReflex(region, corner, l == 0 ? tolerance_m_ : 0.0)) reflex.push_back(corner);
      }
    }
    if (reflex.empty() && region.loops.size() == 1) {
      if (const auto corner = Deepest(region.loops.front(), tolerance_m_))
        reflex.push_back(CornerAt(region, 0, *corner));
    }
    std::stable_sort(reflex.begin(), reflex.end(),
                     [](const Corner& a, const Corner& b) { return a.angle > b.angle + 1e-6; });
    // Slivers only where there is nothing better.
    for (const double least_angle : {kLeastAngle, 0.0}) {
      for (const Corner& corner : reflex) {
        const Cut cut = BestCut(region, corner, reflex, least_angle);
        if (!std::isfinite(cut.score)) continue;
        Apply(region, corner.place, cut);
        return true;
      }
    }
    stuck_ = !any_cut_does_ && !reflex.empty();
    return false;
  }

  Cut BestCut(const Region& region, const Corner& corner, const std::vector<Corner>& reflex, double least_angle) const {
    const double least = std::max(corner.angle - kPi, 0.0);
    const double most = std::min(kPi, corner.angle);
    Cut best;
    for (const double angle : {0.5 * corner.angle, least, most}) {
      CutAt(region, corner, angle, least_angle, best);
    }
    ToPartner(region, corner, reflex, least_angle, best);
    if (std::isfinite(best.score) || any_cut_does_) return best;
    for (const double share : kFan) CutAt(region, corner, least + share * (most - least), least_angle, best);
    return best;
  }

  /// The cut that leaves a corner at an angle from its next side, if it is better.
  void CutAt(const Region& region, const Corner& corner, double angle, double least_angle, Cut& best) const {
    const double least = std::max(corner.angle - kPi, 0.0);
    const double most = std::min(kPi, corner.angle);
    if (std::min(angle, corner.angle - angle) < std::max(least_angle, 1e-6)) return;
    const Eigen::Vector2d direction = Eigen::Rotation2Dd(angle) * corner.to_next.normalized();
    const Hit hit = Shoot(region, corner.at, direction);
    if (!std::isfinite(hit.distance)) return;
    const double at_end = std::acos(std::clamp(std::abs(direction.dot(hit.side)), 0.0, 1.0));
    const double score = hit.distance / (Squareness(std::min(angle, corner.angle - angle)) * Squareness(at_end));
    if (score >= best.score * (1 - 1e-9)) return;
    const Place end = Snapped(region, corner, hit, least, most);
    if (end.share != hit.place.share || end.index != hit.place.index) {  // at a corner
      best = {end, region.loops[end.loop][end.index], score};
    } else if (const auto point = EndOf(region, corner, direction, hit)) {
      best = {end, *point, score};
    }
  }

  /// The nearest, in order; of those as near the first. Most of many are far: they are not put in order.
  static void KeepNearest(std::vector<std::pair<double, const Corner*>>& partners) {
    if (partners.size() > kMostPartners) {
      std::vector<double> distances;
      for (const auto& [distance, other] : partners) distances.push_back(distance);
      const auto last = distances.begin() + (kMostPartners - 1);
      std::nth_element(distances.begin(), last, distances.end());
      std::erase_if(partners, [&](const auto& partner) { return partner.first > *last * (1 + 1e-6); });
    }
    std::stable_sort(partners.begin(), partners.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first * (1 - 1e-9); });
    if (partners.size() > kMostPartners) partners.resize(kMostPartners);
  }

  void ToPartner(const Region& region, const Corner& corner, const std::vector<Corner>& reflex, double least_angle,
                 Cut& best) const {
    const double least = std::max(corner.angle - kPi, 0.0);
    const double most = std::min(kPi, corner.angle);
    std::vector<std::pair<double, const Corner*>> partners;
    for (const Corner& other : reflex) {
      const double distance = (other.at - corner.at).norm();
      if (distance > kTouch_m) partners.emplace_back(distance, &other);
    }
    KeepNearest(partners);
    for (const auto& [distance, other] : partners) {
      const Eigen::Vector2d direction = (other->at - corner.at) / distance;
      const double angle = Turn(corner.to_next, direction);
      if (angle < least - 1e-9 || angle > most + 1e-9) continue;
      if (std::min(angle, corner.angle - angle) < std::max(least_angle, 1e-6)) continue;
      if (!Within(*other, -direction)) continue;
      const double there = Turn(other->to_next, -direction);
      if (std::min(there, other->angle - there) < least_angle) continue;
      const bool both = there >= other->angle - kPi - 1e-9 && there <= kPi + 1e-9;
      const double score =
          distance * (both ? 0.5 : 1.0) /
          (Squareness(std::min(angle, corner.angle - angle)) * Squareness(std::min(there, other->angle - there)));
      if (score >= best.score * (1 - 1e-9) || !Reaches(region, corner, *other)) continue;
      best = {other->place, region.loops[other->place.loop][other->place.index], score};
    }
  }

  /// Ends a cut at a corner where it comes close to one, if the corner can take it.
  Place Snapped(const Region& region, const Corner& corner, const Hit& hit, double least, double most) const {
    const SlabLoop& loop = region.loops[hit.place.loop];
    for (const std::size_t index : {hit.place.index, (hit.place.index + 1) % loop.size()}) {
      const Corner other = CornerAt(region, hit.place.loop, index);
      const Eigen::Vector2d way = other.at - corner.at;
      const Eigen::Vector2d end =
          loop[hit.place.index].middle +
          hit.place.share * (loop[(hit.place.index + 1) % loop.size()].middle - loop[hit.place.index].middle);
      const double off = (other.at - end).norm();
      if (off > kTouch_m && off > kSnap * hit.distance) continue;
      if (way.norm() < kTouch_m) continue;
      const double angle = Turn(corner.to_next, way);
      const double slack = off <= kTouch_m ? 1e-6 : 0.0;
      if (angle < least - slack || angle > most + slack) continue;
      if (Within(other, -way) && Reaches(region, corner, other)) return other.place;
    }
    return hit.place;
  }

  /// Whether a cut leads from corner to corner, and is plane if it has to be.
  bool Reaches(const Region& region, const Corner& from, const Corner& to) const {
    const Eigen::Vector2d way = to.at - from.at;
    const double distance = way.norm();
    const Eigen::Vector2d direction = way / distance;
    if (Shoot(region, from.at, direction).distance < distance - 2 * kTouch_m) return false;
    if (any_cut_does_) return true;
    const SlabPoint& a = region.loops[from.place.loop][from.place.index];
    const SlabPoint& b = region.loops[to.place.loop][to.place.index];
    return std::all_of(kEnds.begin(), kEnds.end(), [&](Height end) {
      const Eigen::Vector2d there = b.*end - a.*end;
      const double along = there.dot(direction);
      return std::abs(Cross(there, direction)) <= plane_m_ && along >= -plane_m_ &&
             Shoot(region, a.*end, direction, end).distance >= along - plane_m_;
    });
  }

  /// Where a plane cut ends on the side that was hit, at the ends of the slab, too; nothing where it comes to another
  /// side there.
  std::optional<SlabPoint> EndOf(const Region& region, const Corner& corner, const Eigen::Vector2d& direction,
                                 const Hit& hit) const {
    const SlabLoop& loop = region.loops[hit.place.loop];
    SlabPoint point = PointAt(loop, hit.place);
    if (any_cut_does_) return point;
    const SlabPoint& from = region.loops[corner.place.loop][corner.place.index];
    const SlabPoint& a = loop[hit.place.index];
    const SlabPoint& b = loop[(hit.place.index + 1) % loop.size()];
    for (const Height end : kEnds) {
      const Eigen::Vector2d way = a.*end - from.*end;
      const Eigen::Vector2d side = b.*end - a.*end;
      const double across = Cross(direction, side);
      if (side.norm() <= plane_m_) {
        if (std::abs(Cross(way, direction)) > plane_m_) return std::nullopt;
        point.*end = a.*end;
      } else {
        if (across <= 0) return std::nullopt;
        const double share = Cross(way, direction) / across;
        const double slack = plane_m_ / side.norm();
        if (share < -slack || share > 1 + slack) return std::nullopt;
        point.*end = a.*end + std::clamp(share, 0.0, 1.0) * side;
      }
      const double along = (point.*end - from.*end).dot(direction);
      if (along < -plane_m_ || Shoot(region, from.*end, direction, end).distance < along - plane_m_)
        return std::nullopt;
    }
    return point;
  }

  static SlabPoint PointAt(const SlabLoop& loop, const Place& place) {
    const SlabPoint& a = loop[place.index];
    const SlabPoint& b = loop[(place.index + 1) % loop.size()];
    const auto mix = [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) -> Eigen::Vector2d {
      return p + place.share * (q - p);
    };
    return {mix(a.middle, b.middle), mix(a.low, b.low), mix(a.high, b.high)};
  }

  void Apply(Region& region, Place begin, const Cut& cut) {
    Place end = cut.end;
    SlabLoop& end_loop = region.loops[end.loop];
    if (end.share > 0) {
      const SlabPoint& a = end_loop[end.index];
      const SlabPoint& b = end_loop[(end.index + 1) % end_loop.size()];
      if ((cut.point.middle - b.middle).norm() < kTouch_m) {
        end = {end.loop, (end.index + 1) % end_loop.size(), 0.0};
      } else if ((cut.point.middle - a.middle).norm() < kTouch_m) {
        end.share = 0;
      } else {
        end_loop.insert(end_loop.begin() + static_cast<std::ptrdiff_t>(end.index) + 1, cut.point);
        if (begin.loop == end.loop && begin.index > end.index) ++begin.index;
        end = {end.loop, end.index + 1, 0.0};
      }
    }
    if (begin.loop == end.loop) {
      Split(region, begin.loop, begin.index, end.index);
    } else {
      Join(region, begin, end);
    }
  }

  static SlabLoop Walk(const SlabLoop& loop, std::size_t from, std::size_t to) {
    SlabLoop part;
    for (std::size_t i = from;; i = (i + 1) % loop.size()) {
      part.push_back(loop[i]);
      if (i == to) return part;
    }
  }

  void Split(Region& region, std::size_t loop, std::size_t a, std::size_t b) {
    std::vector<SlabLoop> outer;
    std::vector<SlabLoop> holes;
    for (SlabLoop& part : std::vector<SlabLoop>{Walk(region.loops[loop], a, b), Walk(region.loops[loop], b, a)}) {
      if (part.size() < 3) continue;
      (SignedArea(part) > 0 ? outer : holes).push_back(std::move(part));
    }
    if (loop != 0) outer.push_back(std::move(region.loops.front()));
    for (std::size_t l = 1; l < region.loops.size(); ++l) {
      if (l != loop) holes.push_back(std::move(region.loops[l]));
    }
    Distribute(std::move(outer), std::move(holes), regions_);
  }

  void Join(Region& region, const Place& begin, const Place& end) {
    SlabLoop joined = region.loops[begin.loop];
    std::rotate(joined.begin(), joined.begin() + static_cast<std::ptrdiff_t>(begin.index), joined.end());
    joined.push_back(joined.front());
    const SlabLoop& other = region.loops[end.loop];
    for (std::size_t i = 0; i <= other.size(); ++i) joined.push_back(other[(end.index + i) % other.size()]);
    const std::size_t into = std::min(begin.loop, end.loop);
    const std::size_t gone = std::max(begin.loop, end.loop);
    region.loops[into] = std::move(joined);
    region.loops.erase(region.loops.begin() + static_cast<std::ptrdiff_t>(gone));
    regions_.push_back(std::move(region));
  }

 public:
  /// Gives each hole to the smallest loop around it.
  static void Distribute(std::vector<SlabLoop> outer, std::vector<SlabLoop> holes, std::vector<Region>& regions) {
    std::vector<Region> made;
    for (SlabLoop& loop : outer) made.push_back({{std::move(loop)}});
    for (SlabLoop& hole : holes) {
      Region* smallest = nullptr;
      for (Region& region : made) {
        const SlabLoop& around = region.loops.front();
        if (!Holds(around, hole)) continue;
        if (smallest == nullptr || SignedArea(around) < SignedArea(smallest->loops.front())) smallest = &region;
      }
      if (smallest != nullptr) smallest->loops.push_back(std::move(hole));
    }
    for (Region& region : made) regions.push_back(std::move(region));
  }

 private:
  double tolerance_m_;
  double plane_m_;
  bool any_cut_does_;
  bool stuck_ = false;
  std::vector<Region> regions_;
};

}  // namespace

std::optional<std::vector<SlabLoop>> ConvexPartition(const std::vector<SlabLoop>& loops, double tolerance_m,
                                                     bool plane_only) {
  std::vector<SlabLoop> outer;
  std::vector<SlabLoop> holes;
  for (const SlabLoop& loop : loops) {
    if (loop.size() >= 3) (SignedArea(loop) > 0 ? outer : holes).push_back(loop);
  }
  std::vector<Region> regions;
  Cutter::Distribute(std::move(outer), std::move(holes), regions);
  std::vector<SlabLoop> polygons;
  for (Region& region : regions) {
    if (!Cutter(std::move(region), tolerance_m, plane_only).Run(polygons)) return std::nullopt;
  }
  return polygons;
}

}  // namespace feeler::cad
