// Laws:
// - Without noise, the outcome that matches best is that of the lattice hypothesis nearest to a continuous truth, and
//   settling it keeps that hypothesis and makes it explain the reading exactly.
// - A contact just behind the end of a move means the free outcome and its wall.
// - A reading far from every prediction matches nothing; an edge met by less than half a cell is explained by a shift.
#include "feeler/execution/lattice/outcome_matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "feeler/core/random.h"
#include "feeler/planner/family/problem_family.h"
#include "tests/execution/box_world.h"

namespace feeler::execution {
namespace {

std::vector<TrackedHypothesis> Track(const planner::Problem& problem) {
  std::vector<TrackedHypothesis> tracked;
  for (const auto& h : problem.hypotheses) tracked.push_back({h, Eigen::Vector3d::Zero()});
  return tracked;
}

TEST(OutcomeMatching, BestMatchIsTheNearestHypothesis) {
  const auto map = HousingMap();
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), map, {5, 5, 5});
  int contacts = 0;
  for (std::uint64_t episode = 0; episode < 2000; ++episode) {
    RandomStream random(7, episode, "matching");
    Eigen::Vector3d truth;
    for (int axis = 0; axis < 3; ++axis) truth[axis] = random.Uniform(-0.499, 4.499);
    const Cell nearest(std::lround(truth.x()), std::lround(truth.y()), std::lround(truth.z()));
    // Somewhere around the housing, free under every hypothesis.
    Cell robot;
    Direction direction;
    do {
      robot = Cell(int(random.Index(60)) - 28, int(random.Index(50)) - 22, int(random.Index(24)) - 8);
      direction = kDirections[random.Index(kDirectionCount)];
    } while (std::any_of(problem.hypotheses.begin(), problem.hypotheses.end(),
                         [&](const auto& h) { return map->Blocked(robot - h.offset); }));
    const GuardedMove move{direction, 1 + int(random.Index(16))};
    const Eigen::Vector3d tool = robot.cast<double>() + map->phase();
    const double travel = DistanceToContact(HousingOverPanel(), (tool - truth) * 0.002, UnitVector(direction)) / 0.002;
    if (travel < 0.0) continue;
    const double commanded = move.cells + 0.25;
    const Touch touch{tool, direction, std::min(travel, commanded), travel < commanded};
    std::vector<TrackedHypothesis> tracked = Track(problem);
    const auto matches = MatchOutcomes(*map, tracked, robot, move, touch);
    ASSERT_FALSE(matches.empty());
    EXPECT_EQ(matches.front().outcome, map->Predict(robot - nearest, move));
    Settle(*map, robot, move, touch, matches.front().outcome, {}, tracked);
    const auto kept =
        std::find_if(tracked.begin(), tracked.end(), [&](const auto& t) { return t.hypothesis.offset == nearest; });
    ASSERT_NE(kept, tracked.end());
    EXPECT_LT(Mismatch(*map, *kept, touch), 1e-4);
    EXPECT_LE(kept->anchor.cwiseAbs().maxCoeff(), 0.501);
    contacts += touch.contact;
  }
  EXPECT_GT(contacts, 100);
}

TEST(OutcomeMatching, ContactJustBehindTheEndIsTheFreeOutcome) {
  const auto map = HousingMap();
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), map, {1, 1, 5});
  const Cell robot(0, 0, 12);
  const GuardedMove move{Direction::kMinusZ, 10};  // ends at 2; walls at 0 .. 4 (tool at z = wall)
  const Touch touch{robot.cast<double>() + map->phase(), Direction::kMinusZ, 10.1, true};
  const auto matches = MatchOutcomes(*map, Track(problem), robot, move, touch);
  ASSERT_FALSE(matches.empty());
  EXPECT_EQ(matches.front().outcome, (Outcome{10, false}));
  EXPECT_NEAR(matches.front().mismatch, 0.4, 1e-4);
}

TEST(OutcomeMatching, FarReadingMatchesNothing) {
  const auto map = HousingMap();
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), map, {1, 1, 3});
  const Cell robot(0, 0, 12);
  const Touch touch{robot.cast<double>() + map->phase(), Direction::kMinusZ, 7.0, true};
  EXPECT_TRUE(MatchOutcomes(*map, Track(problem), robot, {Direction::kMinusZ, 16}, touch).empty());
  EXPECT_FALSE(GrazeShift(*map, Track(problem), touch).has_value());
}

TEST(OutcomeMatching, EdgeMetByLittleIsExplainedByAShiftAwayFromIt) {
  const auto map = HousingMap();
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), map, {1, 1, 1});
  const Cell robot(21, 0, 5);  // half a cell beside the housing
  const Touch touch{robot.cast<double>() + map->phase(), Direction::kMinusZ, 5.5, true};  // yet its top was met
  EXPECT_TRUE(MatchOutcomes(*map, Track(problem), robot, {Direction::kMinusZ, 8}, touch).empty());
  const auto shift = GrazeShift(*map, Track(problem), touch);
  ASSERT_TRUE(shift.has_value());
  EXPECT_GT(shift->x(), 0.0);
  EXPECT_EQ(shift->y(), 0.0);
  EXPECT_EQ(shift->z(), 0.0);
}

TEST(OutcomeMatching, ScrapingAlongAWallIsExplainedByAShiftAwayFromIt) {
  const auto map = HousingMap();
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), map, {1, 1, 1});
  const Cell robot(-10, -17, -3);  // half a cell beside the housing
  const Touch touch{robot.cast<double>() + map->phase(), Direction::kPlusX, 7.0, true};
  const auto shift = GrazeShift(*map, Track(problem), touch);
  ASSERT_TRUE(shift.has_value());
  EXPECT_LT(shift->y(), 0.0);
  EXPECT_EQ(shift->x(), 0.0);
}

}  // namespace
}  // namespace feeler::execution
