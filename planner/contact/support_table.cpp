#include "feeler/planner/contact/support_table.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace feeler::planner {
namespace {

/// More than rounding changes a distance by, as a share of the largest coordinate.
constexpr double kRounding = 1e-12;

const Eigen::Vector3d& FirstOfFarthest(const Eigen::Vector3d* begin, const Eigen::Vector3d* end,
                                       const Eigen::Vector3d& direction) {
  const Eigen::Vector3d* best = begin;
  double farthest = direction.dot(*best);
  for (const Eigen::Vector3d* point = begin + 1; point != end; ++point) {
    const double distance = direction.dot(*point);
    if (distance > farthest) {
      farthest = distance;
      best = point;
    }
  }
  return *best;
}

}  // namespace

SupportTable::SupportTable(const std::vector<Eigen::Vector3d>& points_m) : points_m_(points_m) {
  double largest_m = 0.0;
  for (const Eigen::Vector3d& p : points_m) largest_m = std::max(largest_m, p.cwiseAbs().maxCoeff());
  const double rounding_m = 6 * kRounding * largest_m;
  // From the middle of a square to its corners, and what rounding may place beyond.
  const double reach = std::sqrt(2.0) / kSide * (1 + 1e-9);
  for (int cell = 0; cell < kCells; ++cell) {
    begin_[static_cast<std::size_t>(cell)] = static_cast<std::uint32_t>(listed_m_.size());
    const int face = cell / (kSide * kSide);
    const int axis = face / 2;
    Eigen::Vector3d middle;
    middle[axis] = face % 2 == 0 ? 1.0 : -1.0;
    middle[(axis + 1) % 3] = (2.0 * (cell / kSide % kSide) + 1) / kSide - 1;
    middle[(axis + 2) % 3] = (2.0 * (cell % kSide) + 1) / kSide - 1;
    const Eigen::Vector3d& best = FirstOfFarthest(points_m.data(), points_m.data() + points_m.size(), middle);
    // Along no direction of the cell does a point gain on the best by more than the reach allows.
    for (const Eigen::Vector3d& p : points_m) {
      const double behind_m = middle.dot(best - p) - rounding_m;
      if (behind_m <= 0 || behind_m * behind_m <= reach * reach * (best - p).squaredNorm()) listed_m_.push_back(p);
    }
  }
  begin_.back() = static_cast<std::uint32_t>(listed_m_.size());
}

const Eigen::Vector3d& SupportTable::Farthest(const Eigen::Vector3d& direction) const {
  int axis = 0;
  const double longest = direction.cwiseAbs().maxCoeff(&axis);
  if (!(longest > 0) || !std::isfinite(longest))
    return FirstOfFarthest(points_m_.data(), points_m_.data() + points_m_.size(), direction);
  const auto place = [&](int across) {
    return std::min(static_cast<int>((direction[across] / longest + 1) * (0.5 * kSide)), kSide - 1);
  };
  const int face = 2 * axis + (direction[axis] < 0 ? 1 : 0);
  const int cell = (face * kSide + place((axis + 1) % 3)) * kSide + place((axis + 2) % 3);
  const auto number = static_cast<std::size_t>(cell);
  return FirstOfFarthest(listed_m_.data() + begin_[number], listed_m_.data() + begin_[number + 1], direction);
}

}  // namespace feeler::planner
