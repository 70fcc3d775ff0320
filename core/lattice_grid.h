#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "feeler/core/lattice.h"

/// Arrays over the cells of a box, x fastest, then y, then z; and the cubes of a grid without bounds.
namespace feeler {

/// By how much the index grows with a step along x, y, z in an array over `size` cells.
inline std::array<std::int64_t, 3> GridStrides(const Cell& size) {
  return {1, size.x(), std::int64_t{size.x()} * size.y()};
}

/// Index of cell `c`, counted from the least cell of the box, in an array over `size` cells. `c` must lie inside.
inline std::size_t GridIndex(const Cell& size, const Cell& c) {
  return static_cast<std::size_t>((std::int64_t{c.z()} * size.y() + c.y()) * size.x() + c.x());
}

/// The cell of an index: GridIndex(size, GridCell(size, i)) = i.
inline Cell GridCell(const Cell& size, std::size_t index) {
  const auto i = static_cast<std::int64_t>(index);
  const std::int64_t row = i / size.x();
  return {static_cast<int>(i % size.x()), static_cast<int>(row % size.y()), static_cast<int>(row / size.y())};
}

/// visit(cell) for every cell of the box in the order of the indices.
template <class Visit>
void ForEachCell(const CellBox& box, const Visit& visit) {
  for (int z = box.min.z(); z <= box.max.z(); ++z) {
    for (int y = box.min.y(); y <= box.max.y(); ++y) {
      for (int x = box.min.x(); x <= box.max.x(); ++x) visit(Cell(x, y, z));
    }
  }
}

/// The number of the stretch of length 1 in which `x` lies; what is beyond 2^60 of them counts as there, so that its
/// neighbours have numbers, too.
inline std::int64_t StretchOf(double x) {
  constexpr double kMost = 0x1p60;
  if (!(x > -kMost)) return -(std::int64_t{1} << 60);  // NaN, too
  return static_cast<std::int64_t>(std::min(std::floor(x), kMost));
}

/// Numbers along x, y, z of the cube of length `edge` in which a point lies.
inline std::array<std::int64_t, 3> CubeOf(const Eigen::Vector3d& point, double edge) {
  return {StretchOf(point.x() / edge), StretchOf(point.y() / edge), StretchOf(point.z() / edge)};
}

}  // namespace feeler
