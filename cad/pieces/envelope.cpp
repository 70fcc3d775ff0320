#include "feeler/cad/pieces/envelope.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace feeler::cad {
namespace {

/// Sides shorter than this have no direction.
constexpr double kShort_m = 1e-9;

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

SlabLoop At(const SlabLoop& loop, Eigen::Vector2d SlabPoint::*height) {
  SlabLoop section = loop;
  for (SlabPoint& p : section) p.low = p.high = p.middle = p.*height;
  return section;
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

}  // namespace

// Andrew (1979).
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

bool Envelope::Add(const Slab& slab) {
  const Envelope before = *this;
  if (with_ends_ ? AddSection(slab, &SlabPoint::low) && AddSection(slab, &SlabPoint::middle) &&
                       AddSection(slab, &SlabPoint::high)
                 : AddSection(slab, &SlabPoint::middle))
    return true;
  outlines_ = before.outlines_;
  holes_ = before.holes_;
  return false;
}

void Envelope::Cover(const std::vector<Eigen::Vector3d>& points,
                     const std::function<double(const Eigen::Vector3d&)>& allowed_m) {
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

std::vector<SlabLoop> Envelope::loops() const {
  std::vector<SlabLoop> all = outlines_;
  all.insert(all.end(), holes_.begin(), holes_.end());
  return all;
}

bool Envelope::AddSection(const Slab& slab, Eigen::Vector2d SlabPoint::*height) {
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

bool Envelope::Widen(const std::vector<SlabLoop>& outlines) {
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

bool Envelope::Narrow(const std::vector<SlabLoop>& outlines, const std::vector<SlabLoop>& holes) {
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
std::optional<SlabLoop> Envelope::Trimmed(const SlabLoop& hole, const std::vector<SlabLoop>& lines) const {
  const double most_m = 4 * slack_m_;
  SlabLoop rest = HullAround(hole, hole);
  if (!LiesWithin(rest, hole, slack_m_)) return std::nullopt;
  for (const SlabLoop& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      const Eigen::Vector2d& a = line[i].middle;
      const Eigen::Vector2d side = line[(i + 1) % line.size()].middle - a;
      if (side.norm() < kShort_m) continue;
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
bool Envelope::IsAir(const SlabLoop& hole, const std::vector<SlabLoop>& section) const {
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

}  // namespace feeler::cad
