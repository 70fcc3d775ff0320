// Laws: cells of a box are visited once each, in the order of their indices, which are 0, 1, 2, ... ; the cell of an
// index has that index; a step along an axis changes the index by that axis' stride; an empty box has no cells.
#include "feeler/core/lattice_grid.h"

#include <gtest/gtest.h>

namespace feeler {
namespace {

TEST(LatticeGrid, VisitsIndicesInOrder) {
  for (const CellBox& box : {CellBox{{0, 0, 0}, {4, 2, 3}}, CellBox{{-3, 5, -7}, {-3, 9, -2}}, CellBox{}}) {
    const Cell size = box.Size();
    std::size_t index = 0;
    ForEachCell(box, [&](const Cell& cell) {
      const Cell inside = cell - box.min;
      EXPECT_EQ(GridIndex(size, inside), index);
      EXPECT_EQ(GridCell(size, index), inside);
      for (int axis = 0; axis < 3; ++axis) {
        if (cell[axis] == box.max[axis]) continue;
        Cell next = inside;
        ++next[axis];
        EXPECT_EQ(static_cast<std::int64_t>(GridIndex(size, next) - index),
                  GridStrides(size)[static_cast<std::size_t>(axis)]);
      }
      ++index;
    });
    EXPECT_EQ(static_cast<std::int64_t>(index), box.Count());
  }
}

}  // namespace
}  // namespace feeler
