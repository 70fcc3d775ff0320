#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "feeler/core/lattice.h"

/// Arrays over the cells of a box, x fastest, then y, then z.
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

}  // namespace feeler
