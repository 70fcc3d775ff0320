#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace feeler::planner {

/// The point of many that is farthest along a direction, in time that grows with the logarithm of their number where
/// they are the corners of a convex body: a tree of boxes, searched by branch and bound. The answer is, bit for bit,
/// that of a walk over all points that keeps the first of the farthest.
class SupportTree {
 public:
  SupportTree() = default;
  explicit SupportTree(const std::vector<Eigen::Vector3d>& points_m);

  bool empty() const { return nodes_.empty(); }
  /// `direction` need not be a unit vector.
  const Eigen::Vector3d& Farthest(const Eigen::Vector3d& direction) const;

 private:
  struct Node {
    Eigen::Vector3d center_m;
    Eigen::Vector3d half_m;  ///< of the box, and a little more than rounding may come to
    std::size_t first = 0;   ///< of its points, for a leaf; else the number of its first child
    std::size_t count = 0;   ///< 0: an inner node, with a child at first and one at second
    std::size_t second = 0;
  };
  struct Found {
    std::size_t at = 0;  ///< in points_m_
    double distance = 0.0;
  };

  std::size_t Build(std::size_t first, std::size_t count, double rounding_m);
  void Search(const Node& node, const Eigen::Vector3d& direction, Found& best) const;

  std::vector<Eigen::Vector3d> points_m_;  ///< in the order of the leaves
  std::vector<std::size_t> number_;        ///< of each in the order in which they were given
  std::vector<Node> nodes_;
};

}  // namespace feeler::planner
