#include "feeler/cad/pieces/unite_pieces.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "feeler/cad/pieces/stays_inside.h"

namespace feeler::cad {
namespace {

/// Pieces whose boxes are farther apart do not touch.
constexpr double kTouch_m = 2e-6;

bool Near(const Box& a, const Box& b) {
  return Box(a.min().array() - kTouch_m, a.max().array() + kTouch_m).intersects(b);
}

/// How much of the smaller of two boxes, seen from above, lies over the other: 1 for pieces of one column.
double ColumnShare(const Box& a, const Box& b) {
  const Eigen::Vector3d overlap = a.intersection(b).sizes();
  const auto area = [](const Eigen::Vector3d& s) { return s.x() * s.y(); };
  if (overlap.x() <= 0 || overlap.y() <= 0) return 0;
  return area(overlap) / std::max(std::min(area(a.sizes()), area(b.sizes())), 1e-15);
}

class Merger {
 public:
  Merger(std::vector<ConvexPiece> pieces, const MeshTree& solid, const DecomposeOptions& options)
      : pieces_(std::move(pieces)), solid_(solid), options_(options), body_(pieces_.size()), never_(pieces_.size()) {
    std::iota(body_.begin(), body_.end(), std::size_t{0});
  }

  std::vector<ConvexPiece> Run() {
    // First what stands on each other, so that wedges around a bore stay wedges: two by two, for a dome of a hundred
    // slices that grows slice by slice is hulled a hundred times. Then side by side.
    while (Pass(0.9, false)) {
    }
    while (Pass(0.0, true)) {
    }
    return std::move(pieces_);
  }

 private:
  /// Unites pieces with the next that they take; `grow`: with as many as they take.
  bool Pass(double least_share, bool grow) {
    const auto low = [](const ConvexPiece& piece) { return piece.bounds.min().z(); };
    const bool from_below = std::is_sorted(pieces_.begin(), pieces_.end(), [&](const auto& a, const auto& b) {
      return low(a) < low(b);  // as slices come: none is looked for above the piece
    });
    std::vector<bool> gone(pieces_.size(), false);
    bool any = false;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (gone[i]) continue;
      for (std::size_t j = i + 1; j < pieces_.size();) {
        if (from_below && low(pieces_[j]) > pieces_[i].bounds.max().z() + kTouch_m) break;
        if (!gone[j] && Near(pieces_[i].bounds, pieces_[j].bounds) &&
            ColumnShare(pieces_[i].bounds, pieces_[j].bounds) >= least_share && Unite(i, j)) {
          any = true;
          gone[j] = true;
          j = grow ? i + 1 : pieces_.size();
        } else {
          ++j;
        }
      }
    }
    Remove(gone);
    return any;
  }

  void Remove(const std::vector<bool>& gone) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (gone[i]) continue;
      if (kept < i) {
        pieces_[kept] = std::move(pieces_[i]);
        body_[kept] = body_[i];
      }
      ++kept;
    }
    pieces_.resize(kept);
    body_.resize(kept);
  }

  /// The first of two is then both.
  bool Unite(std::size_t i, std::size_t j) {
    const std::size_t a = body_[i];
    const std::size_t b = body_[j];
    if (never_[a].contains(b) || apart_.contains({a, b})) return false;
    std::vector<Eigen::Vector3d> points = pieces_[i].surface.points;
    points.insert(points.end(), pieces_[j].surface.points.begin(), pieces_[j].surface.points.end());
    auto hull = HullOf(points);
    const bool inside = hull && StaysInside(*hull, solid_, options_);
    // A hull that leaves the solid does so with more in it, too; but what a thin one may is less.
    if (hull && !inside && !IsThin(*hull, options_)) {
      never_[a].insert(b);
      never_[b].insert(a);
      return false;
    }
    if (!inside || !IsLittleMore(*hull, pieces_[i], pieces_[j])) {
      apart_.insert({a, b});
      return false;
    }
    pieces_[i] = std::move(*hull);
    body_[i] = never_.size();
    std::set<std::size_t> never = never_[a];
    never.insert(never_[b].begin(), never_[b].end());
    for (const std::size_t other : never) never_[other].insert(body_[i]);
    never_.push_back(std::move(never));
    return true;
  }

  bool IsLittleMore(const ConvexPiece& hull, const ConvexPiece& a, const ConvexPiece& b) const {
    const double allowed = 2 * std::max(options_.tolerance_near_m, options_.tolerance_far_m) * AreaOf(hull.surface) +
                           2e-3 * (a.volume + b.volume);
    return hull.volume - a.volume - b.volume <= allowed;
  }

  std::vector<ConvexPiece> pieces_;
  const MeshTree& solid_;
  const DecomposeOptions& options_;
  std::vector<std::size_t> body_;  ///< of each piece: its number, never used again when it is united with another
  std::vector<std::set<std::size_t>> never_;             ///< of each body: those that no body of both can be with
  std::set<std::pair<std::size_t, std::size_t>> apart_;  ///< pairs that were tried in vain
};

}  // namespace

std::vector<ConvexPiece> United(std::vector<ConvexPiece> pieces, const MeshTree& solid,
                                const DecomposeOptions& options) {
  return Merger(std::move(pieces), solid, options).Run();
}

}  // namespace feeler::cad
