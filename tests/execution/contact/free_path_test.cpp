// Laws: a path begins at its start and ends at the goal; the straight lines between its corners keep clear of every box
// by at least half a cell from the first clear corner on; an unreachable goal has no path. From beside a wall the first
// line comes no nearer to it. Of several goals none is to be had sooner by a straight clear line; what follows counts.
#include "feeler/execution/contact/free_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "feeler/core/random.h"
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

/// Greatest of the distances along the axes from a point to a box, m; negative inside.
double Outside(const Box& box, const Eigen::Vector3d& at) { return (box.min - at).cwiseMax(at - box.max).maxCoeff(); }

TEST(FindFreePath, LeavesTheWallItStandsAt) {
  const auto map = HousingMap();
  const auto boxes = HousingOverPanel();
  RandomStream random(12, 0, "beside walls");
  int beside = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const Cell start(static_cast<int>(random.Index(59)) - 29, static_cast<int>(random.Index(51)) - 25,
                     static_cast<int>(random.Index(20)) - 14);
    if (map->Blocked(start) || IsClear(*map, start)) continue;
    const Cell goal(0, 0, 8);
    const auto path = FindFreePath(*map, start, EndAt(goal));
    ASSERT_TRUE(path.has_value());
    ++beside;
    const Eigen::Vector3d from = 0.002 * ((*path)[0].cast<double>() + map->phase());
    const Eigen::Vector3d to = 0.002 * ((*path)[1].cast<double>() + map->phase());
    for (const Box& box : boxes) {
      const double here = Outside(box, from);
      for (int s = 0; s <= 50; ++s) {
        EXPECT_GE(Outside(box, from + (to - from) * s / 50.0), std::min(here, 0.001) - 1e-9) << start.transpose();
      }
    }
  }
  EXPECT_GT(beside, 20);
}

TEST(FindFreePath, TakesTheGoalThatIsDoneSoonest) {
  const auto map = HousingMap();
  const Cell start(0, 0, 6);
  const auto time = [](const Cell& a, const Cell& b) { return std::sqrt((a - b).cast<double>().norm()); };
  const Cell near(4, 0, 6);
  const Cell far(6, 0, 7);
  for (const double rest_of_near : {0.0, 5.0}) {
    const auto path = FindFreePath(*map, start, [&](const Cell& c) -> std::optional<double> {
      if (c == near) return rest_of_near;
      return c == far ? std::optional(0.0) : std::nullopt;
    });
    ASSERT_TRUE(path.has_value());
    const bool nearer = time(start, near) + rest_of_near < time(start, far);
    EXPECT_EQ(path->back(), nearer ? near : far);
    EXPECT_EQ(path->size(), 2U) << "one straight line";
  }
}

}  // namespace
}  // namespace feeler::execution
