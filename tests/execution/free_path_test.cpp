// Laws: a path begins at its start and ends at the goal; the straight lines between its corners keep clear of every box
// by at least half a cell from the first clear corner on; an unreachable goal has no path.
#include "execution/free_path.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "tests/execution/box_world.h"

namespace feeler::execution {
namespace {

TEST(FindFreePath, KeepsClearOfTheHousing) {
  const auto map = HousingMap();
  const auto boxes = HousingOverPanel();
  RandomStream random(11, 0, "paths");
  for (int trial = 0; trial < 30; ++trial) {
    const auto draw = [&] {
      Cell cell;
      do {
        cell = Cell(int(random.Index(59)) - 29, int(random.Index(51)) - 25, int(random.Index(20)) - 14);
      } while (!IsClear(*map, cell));
      return cell;
    };
    const Cell start = draw();
    const Cell goal = draw();
    const auto path = FindFreePath(*map, start, EndAt(goal));
    ASSERT_TRUE(path.has_value());
    EXPECT_EQ(path->front(), start);
    EXPECT_EQ(path->back(), goal);
    for (std::size_t i = 0; i + 1 < path->size(); ++i) {
      for (int s = 0; s <= 100; ++s) {
        const Eigen::Vector3d cells =
            (*path)[i].cast<double>() + ((*path)[i + 1] - (*path)[i]).cast<double>() * s / 100.0 + map->phase();
        for (const Box& box : boxes) {
          const Eigen::Array3d at = 0.002 * cells.array();
          EXPECT_FALSE((at > box.min.array() - 0.001).all() && (at < box.max.array() + 0.001).all()) << at.transpose();
        }
      }
    }
  }
}

TEST(FindFreePath, NoWayIntoAWall) {
  EXPECT_FALSE(FindFreePath(*HousingMap(), Cell(0, 0, 2), EndAt(Cell(0, 0, -5))).has_value());
}

}  // namespace
}  // namespace feeler::execution
