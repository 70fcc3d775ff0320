#include "feeler/perception/contradiction.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

#include "feeler/perception/clusters.h"

namespace feeler::perception {
namespace {

constexpr double kBehind_m = 0.015;  // what is measured farther behind the model says that it is not there
constexpr float kNothing = std::numeric_limits<float>::infinity();

/// The share of places beyond the edges of what the eye sees of the model where the scene carries the face on.
double Beyond(const IcpFit& fit, const TargetModel& model, const Pose& pose, const Eigen::Vector3d& eye_m) {
  constexpr double kOut_m = 0.026;        // the middle of 12 to 40 mm
  constexpr double kOnModel_m = 0.011;    // a place so near to the model is on it
  constexpr double kAlong_m = 0.008;      // from such a place to a measured point that carries the face on
  constexpr double kSamePlane_m = 0.005;  // across
  constexpr int kDirections = 8;
  const TargetModel::Level& coarse = model.coarse();
  int places = 0;
  int carried_on = 0;
  for (const std::size_t i : Visible(coarse, eye_m)) {
    const Eigen::Vector3d& n = coarse.surface.normals[i];
    const Eigen::Vector3d u = n.unitOrthogonal();
    const Eigen::Vector3d v = n.cross(u);
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kDirections;
      const Eigen::Vector3d place = coarse.surface.points[i] + kOut_m * (std::cos(angle) * u + std::sin(angle) * v);
      if (model.fine().tree.Nearest(place).squared_m2 < kOnModel_m * kOnModel_m) continue;
      ++places;
      const Eigen::Vector3d there = pose * place;
      const Eigen::Vector3d apart = fit.scene_tree.points()[fit.scene_tree.Nearest(there).index] - there;
      const double across = (pose.linear() * n).dot(apart);
      if (std::abs(across) < kSamePlane_m && apart.squaredNorm() - across * across < kAlong_m * kAlong_m) ++carried_on;
    }
  }
  return places > 0 ? static_cast<double>(carried_on) / places : 0.0;
}

/// The area of the largest group of points of the model that are no more than two spacings apart.
double LargestPatch_m2(const Points& points, double spacing_m) {
  int groups = 0;
  const std::vector<int> group_of = GroupsOf(points, 2.0 * spacing_m, groups);
  std::vector<int> sizes(static_cast<std::size_t>(groups));
  for (const int group : group_of) ++sizes[static_cast<std::size_t>(group)];
  const int largest = sizes.empty() ? 0 : *std::max_element(sizes.begin(), sizes.end());
  return largest * spacing_m * spacing_m;
}

}  // namespace

SightGrid::SightGrid(const Points& measured, const Eigen::Vector3d& eye_m, const Eigen::Vector3d& middle_m,
                     double spacing_m)
    : eye_m_(eye_m) {
  constexpr int kLargestSide = 1000;
  const double distance_m = std::max((middle_m - eye_m).norm(), 1e-3);
  ahead_ = (middle_m - eye_m) / distance_m;
  right_ = ahead_.unitOrthogonal();
  down_ = ahead_.cross(right_);
  cell_ = std::max(spacing_m / distance_m, kWidest / kLargestSide);
  side_ = static_cast<int>(std::ceil(kWidest / cell_)) + 1;
  const auto width = static_cast<std::size_t>(2 * side_ + 1);
  range_m_.assign(width * width, kNothing);
  for (const Eigen::Vector3d& p : measured) {
    const auto cell = CellOf(p - eye_m);
    if (!cell) continue;
    float& nearest = range_m_[static_cast<std::size_t>(cell->second) * width + static_cast<std::size_t>(cell->first)];
    nearest = std::min(nearest, static_cast<float>((p - eye_m).norm()));
  }
}

std::optional<std::pair<int, int>> SightGrid::CellOf(const Eigen::Vector3d& ray) const {
  const double depth = ray.dot(ahead_);
  if (!(depth > 0.0)) return std::nullopt;
  const double u = ray.dot(right_) / depth;
  const double v = ray.dot(down_) / depth;
  if (!(std::abs(u) < kWidest && std::abs(v) < kWidest)) return std::nullopt;
  return std::pair{side_ + static_cast<int>(std::floor(u / cell_)), side_ + static_cast<int>(std::floor(v / cell_))};
}

std::optional<double> SightGrid::Range_m(const Eigen::Vector3d& point_m) const {
  const auto cell = CellOf(point_m - eye_m_);
  if (!cell) return std::nullopt;
  const auto at = [&](int u, int v) {
    return range_m_[static_cast<std::size_t>(v) * static_cast<std::size_t>(2 * side_ + 1) +
                    static_cast<std::size_t>(u)];
  };
  if (at(cell->first, cell->second) == kNothing) return std::nullopt;
  float nearest = kNothing;
  for (int v = std::max(cell->second - 1, 0); v <= std::min(cell->second + 1, 2 * side_); ++v) {
    for (int u = std::max(cell->first - 1, 0); u <= std::min(cell->first + 1, 2 * side_); ++u) {
      nearest = std::min(nearest, at(u, v));
    }
  }
  return nearest;
}

void Contradict(const IcpFit& fit, const TargetModel& model, const SightGrid& sight, const Pose& pose,
                MatchEvidence& evidence) {
  const Eigen::Vector3d eye_m = pose.inverse() * fit.eye_m;
  const std::vector<std::size_t> visible = Visible(fit.model, eye_m);
  if (visible.empty() || fit.scene.empty()) return;
  evidence.beyond = Beyond(fit, model, pose, eye_m);
  Points through;
  for (const std::size_t i : visible) {
    const Eigen::Vector3d& m = fit.model.surface.points[i];
    const Eigen::Vector3d there = pose * m;
    if (fit.scene_tree.Nearest(there).squared_m2 < kMet_m * kMet_m) continue;
    const std::optional<double> range_m = sight.Range_m(there);
    if (range_m && *range_m > (m - eye_m).norm() + kBehind_m) through.push_back(m);
  }
  evidence.seen_through = static_cast<double>(through.size()) / static_cast<double>(visible.size());
  evidence.missing_m2 = LargestPatch_m2(through, fit.model.spacing_m);
}

}  // namespace feeler::perception
