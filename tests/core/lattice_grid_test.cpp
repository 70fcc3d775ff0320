// Laws: cells of a box are visited once each, in the order of their indices, which are 0, 1, 2, ... ; the cell of an
// index has that index; a step along an axis changes the index by that axis' stride; an empty box has no cells; a point
// lies in its cube, and any number in some stretch.
#include "feeler/core/lattice_grid.h"

#include <gtest/gtest.h>

#include <limits>

#include "feeler/core/random.h"

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

TEST(CubeOf, HoldsItsPointAndEndsSomewhere) {
  RandomStream random(1, 0, "points");
  for (int i = 0; i < 1000; ++i) {
    const double edge = random.Uniform(0.001, 2.0);
    Eigen::Vector3d point;
    for (int k = 0; k < 3; ++k) point[k] = random.Uniform(-100.0, 100.0);
    const auto cube = CubeOf(point, edge);
    for (int k = 0; k < 3; ++k) {
      const auto number = static_cast<double>(cube[static_cast<std::size_t>(k)]);
      EXPECT_LE(number, point[k] / edge);
      EXPECT_GT(number + 1.0, point[k] / edge);
    }
  }
  constexpr std::int64_t kMost = std::int64_t{1} << 60;
  EXPECT_EQ(StretchOf(1e300), kMost);
  EXPECT_EQ(StretchOf(std::numeric_limits<double>::infinity()), kMost);
  EXPECT_EQ(StretchOf(-1e300), -kMost);
  EXPECT_EQ(StretchOf(std::numeric_limits<double>::quiet_NaN()), -kMost);
}

}  // namespace
}  // namespace feeler
