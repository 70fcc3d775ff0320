// Laws: a draw is a pure function of (task, family, seed, episode); problems are uniform over the family; the true
// offset is uniform over the lattice span plus half a cell each side, i.e. over +-n/2 cells, and lies on no lattice.
#include "feeler/workflow/episode/episode_draw.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "feeler/core/error.h"
#include "tests/workflow/episode/three_axis_task.h"

namespace feeler::workflow {
namespace {

TEST(DrawEpisode, IsAPureFunctionOfItsKey) {
  const Task task = ThreeAxisTask();
  const planner::ProblemFamily family = planner::ParseProblemFamily("2..5x2..5x2..5");
  for (std::uint64_t episode : {0, 1, 17}) {
    const EpisodeDraw a = DrawEpisode(task, family, 5, episode);
    const EpisodeDraw b = DrawEpisode(task, family, 5, episode);
    EXPECT_EQ(a.extents, b.extents);
    EXPECT_EQ(a.world_T_true.matrix(), b.world_T_true.matrix());
  }
}

TEST(DrawEpisode, OffsetsFillTheBoxUniformly) {
  const Task task = ThreeAxisTask();
  const planner::ProblemFamily family = planner::ParseProblemFamily("3x4x7");
  constexpr int kDraws = 20000;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero(), largest = Eigen::Vector3d::Zero();
  for (int k = 0; k < kDraws; ++k) {
    const EpisodeDraw draw = DrawEpisode(task, family, 3, static_cast<std::uint64_t>(k));
    const Eigen::Vector3d offset = (draw.world_T_estimate.inverse() * draw.world_T_true).translation() / task.cell_m;
    sum += offset;
    squares += offset.cwiseAbs2();
    largest = largest.cwiseMax(offset.cwiseAbs());
  }
  const Eigen::Vector3d width(3, 4, 7);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LE(largest[axis], width[axis] / 2);
    EXPECT_GT(largest[axis], width[axis] / 2 * 0.99);
    EXPECT_NEAR(sum[axis] / kDraws, 0, 5 * width[axis] / std::sqrt(12.0 * kDraws));
    EXPECT_NEAR(squares[axis] / kDraws, width[axis] * width[axis] / 12, 0.03 * width[axis] * width[axis] / 12);
  }
}

TEST(DrawEpisode, ProblemsAreUniformOverTheFamily) {
  const planner::ProblemFamily family = planner::ParseProblemFamily("2..3x2..3x2");
  std::map<planner::Extents, int> counts;
  for (std::uint64_t k = 0; k < 8000; ++k) ++counts[DrawEpisode(ThreeAxisTask(), family, 9, k).extents];
  ASSERT_EQ(counts.size(), 4U);
  for (const auto& [extents, count] : counts) EXPECT_NEAR(count, 2000, 5 * std::sqrt(2000 * 0.75));
  EXPECT_THROW(DrawEpisode(ThreeAxisTask(), {}, 1, 1), InputError);
}

}  // namespace
}  // namespace feeler::workflow
