#include "feeler/planner/pomdp/search/sawtooth.h"

#include <algorithm>
#include <limits>

#include "feeler/planner/pomdp/model/state_bounds.h"

namespace feeler::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kNone = ~std::uint32_t{0};

}  // namespace

Sawtooth::Sawtooth(std::vector<std::vector<double>> rows) : rows_(std::move(rows)) {
  corners_ = rows_.front();
  for (const std::vector<double>& row : rows_) {
    for (std::size_t i = 0; i < row.size(); ++i) corners_[i] = std::max(corners_[i], row[i]);
  }
  better_corners_ = corners_;
}

double Sawtooth::AtCorners(const Point& point) const {
  double sum = 0.0;
  for (const Entry& e : point.entries) sum += corners_[e.index] / e.inverse;
  return sum;
}

double Sawtooth::Advance(std::span<const SparseEntry> belief, const double* dense, double known, Cursor& cursor) const {
  double best = kInfinity;
  if (cursor.epoch != epoch_) {
    const bool first = cursor.epoch == kNone;
    cursor = {epoch_, 0, 0.0};
    for (const SparseEntry& s : belief) cursor.at_corners += s.value * corners_[s.index];
    best = cursor.at_corners;
    if (first) best = std::min(best, BestRow(rows_, belief));
  }
  for (; cursor.seen < points_.size(); ++cursor.seen) {
    const Point& point = points_[cursor.seen];
    if (point.dropped) continue;
    double share = kInfinity;  // how much of the belief the point makes up
    const double least = std::min(best, known);
    for (const Entry& e : point.entries) {
      share = std::min(share, dense[e.index] * e.inverse);
      if (cursor.at_corners + share * point.gain >= least) break;
    }
    best = std::min(best, cursor.at_corners + share * point.gain);
  }
  return best;
}

void Sawtooth::Add(std::uint32_t owner, std::span<const SparseEntry> belief, double upper) {
  if (belief.size() == 1) better_corners_[belief[0].index] = std::min(better_corners_[belief[0].index], upper);
  if (owner >= point_of_.size())
    point_of_.resize(std::max<std::size_t>(owner + std::size_t{1}, point_of_.size() * 2), kNone);
  if (point_of_[owner] != kNone) points_[point_of_[owner]].dropped = true;
  Point point;
  for (const SparseEntry& s : belief) point.entries.push_back({s.index, 1.0 / s.value});
  std::ranges::stable_sort(point.entries, {}, &Entry::inverse);
  point.upper = upper;
  point.gain = upper - AtCorners(point);
  point.owner = owner;
  point_of_[owner] = static_cast<std::uint32_t>(points_.size());
  bytes_ += sizeof(Point) + point.entries.size() * sizeof(Entry);
  points_.push_back(std::move(point));
}

void Sawtooth::Rebase(std::vector<double>& dense, Pulse& pulse) {
  corners_ = better_corners_;
  for (Point& point : points_) {
    point.gain = point.upper - AtCorners(point);
    point.dropped = point.dropped || point.gain >= 0.0;
  }
  // Newer points are better: an older one goes where they imply it.
  for (Point& point : points_) {
    if (point.dropped) continue;
    pulse(10 * points_.size());
    for (const Entry& e : point.entries) dense[e.index] = 1.0 / e.inverse;
    const double at_corners = point.upper - point.gain;
    for (const Point& other : points_) {
      if (other.dropped || &other == &point) continue;
      double share = kInfinity;
      bool implies = true;
      for (const Entry& e : other.entries) {
        share = std::min(share, dense[e.index] * e.inverse);
        implies = at_corners + share * other.gain <= point.upper;
        if (!implies) break;
      }
      if (!implies) continue;
      point.dropped = true;
      break;
    }
    for (const Entry& e : point.entries) dense[e.index] = 0.0;
  }
  std::erase_if(points_, [](const Point& point) { return point.dropped; });
  point_of_.assign(point_of_.size(), kNone);
  bytes_ = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    point_of_[points_[i].owner] = static_cast<std::uint32_t>(i);
    bytes_ += sizeof(Point) + points_[i].entries.size() * sizeof(Entry);
  }
  kept_ = points_.size();
  ++epoch_;
}

}  // namespace feeler::planner
