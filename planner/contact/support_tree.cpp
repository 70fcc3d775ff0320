#include "feeler/planner/contact/support_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace feeler::planner {
namespace {

constexpr std::size_t kLeaf = 8;
/// More than rounding changes a distance by, as a share of the largest coordinate.
constexpr double kRounding = 1e-12;

}  // namespace

SupportTree::SupportTree(const std::vector<Eigen::Vector3d>& points_m) : points_m_(points_m), number_(points_m.size()) {
  if (points_m.empty()) return;
  std::iota(number_.begin(), number_.end(), std::size_t{0});
  double largest_m = 0.0;
  for (const Eigen::Vector3d& p : points_m) largest_m = std::max(largest_m, p.cwiseAbs().maxCoeff());
  Build(0, points_m.size(), kRounding * largest_m);
  for (std::size_t i = 0; i < number_.size(); ++i) points_m_[i] = points_m[number_[i]];
}

std::size_t SupportTree::Build(std::size_t first, std::size_t count, double rounding_m) {
  const std::size_t number = nodes_.size();
  nodes_.emplace_back();
  Eigen::Vector3d low = points_m_[number_[first]];
  Eigen::Vector3d high = low;
  for (std::size_t i = first; i < first + count; ++i) {
    low = low.cwiseMin(points_m_[number_[i]]);
    high = high.cwiseMax(points_m_[number_[i]]);
  }
  Node node{0.5 * (low + high), (0.5 * (high - low)).array() + rounding_m, first, count, 0};
  if (count > kLeaf) {
    int axis = 0;
    node.half_m.maxCoeff(&axis);
    const std::size_t half = count / 2;
    const auto begin = number_.begin() + static_cast<std::ptrdiff_t>(first);
    std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(half), begin + static_cast<std::ptrdiff_t>(count),
                     [&](std::size_t a, std::size_t b) {
                       const double x = points_m_[a][axis];
                       const double y = points_m_[b][axis];
                       return x != y ? x < y : a < b;
                     });
    node.count = 0;
    node.first = Build(first, half, rounding_m);
    node.second = Build(first + half, count - half, rounding_m);
  }
  nodes_[number] = node;
  return number;
}

void SupportTree::Search(const Node& node, const Eigen::Vector3d& direction, Found& best) const {
  if (node.count > 0) {
    for (std::size_t i = node.first; i < node.first + node.count; ++i) {
      const double distance = direction.dot(points_m_[i]);
      if (distance < best.distance || (distance == best.distance && number_[i] > number_[best.at])) continue;
      best = {i, distance};
    }
    return;
  }
  const auto bound = [&](const Node& child) {
    return direction.dot(child.center_m) + direction.cwiseAbs().dot(child.half_m);
  };
  const Node* near = &nodes_[node.first];
  const Node* far = &nodes_[node.second];
  double near_bound = bound(*near);
  double far_bound = bound(*far);
  if (near_bound < far_bound) {
    std::swap(near, far);
    std::swap(near_bound, far_bound);
  }
  if (near_bound >= best.distance) Search(*near, direction, best);
  if (far_bound >= best.distance) Search(*far, direction, best);
}

const Eigen::Vector3d& SupportTree::Farthest(const Eigen::Vector3d& direction) const {
  Found best{0, direction.dot(points_m_.front())};
  Search(nodes_.front(), direction, best);
  return points_m_[best.at];
}

}  // namespace feeler::planner
