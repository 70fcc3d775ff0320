#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace feeler::planner {

/// The point of many that is farthest along a direction, of those alone that may be: for each cell of directions, the
/// squares of a grid on the faces of a cube, the points are listed that are farthest along some direction of it. The
/// answer is, bit for bit, that of a walk over all points that keeps the first of the farthest.
class SupportTable {
 public:
  explicit SupportTable(const std::vector<Eigen::Vector3d>& points_m);

  /// `direction` need not be a unit vector.
  const Eigen::Vector3d& Farthest(const Eigen::Vector3d& direction) const;

 private:
  static constexpr int kSide = 16;  ///< cells along an edge of the cube
  static constexpr int kCells = 6 * kSide * kSide;

  std::vector<Eigen::Vector3d> points_m_;
  std::array<std::uint32_t, kCells + 1> begin_{};  ///< of each cell's points
  std::vector<Eigen::Vector3d> listed_m_;          ///< cell after cell, each in the order of points_m_
};

}  // namespace feeler::planner
