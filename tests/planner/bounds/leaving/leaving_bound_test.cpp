// Oracle: value iteration over all reachable beliefs (brute_force.h). Laws of the leaving bound: at most the optimal
// cost at every reachable belief of random small lattice problems, with all kinds of costs, weights and goals, and 0 at
// goals; scaled by the weights and by the costs as the optimal cost is. It closes what certificates leave open:
// problems of a small target and many hypotheses are solved to a gap within few expansions.

#include "feeler/planner/bounds/leaving/leaving_bound.h"

#include <gtest/gtest.h>

#include <cmath>

#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/solve.h"
#include "tests/planner/brute_force.h"
#include "tests/planner/random_problems.h"

namespace feeler::planner {
namespace {

using testing::BruteForce;
using testing::RandomProblem;
using testing::RandomProblemOptions;

class LeavingBoundLaws : public ::testing::TestWithParam<int> {};

TEST_P(LeavingBoundLaws, Admissible) {
  RandomProblemOptions options;
  options.three_d = (GetParam() & 1) != 0;
  options.weights = (GetParam() & 2) != 0;
  options.costs = (GetParam() & 4) != 0;
  options.insertable = (GetParam() & 8) != 0;
  options.most_hypotheses = options.three_d ? 5 : 7;
  for (std::uint64_t index = 0; index < 12; ++index) {
    const LatticeProblemData data = RandomProblem(900 + static_cast<std::uint64_t>(GetParam()), index, options);
    SCOPED_TRACE(data.name);
    const BruteForce oracle(data);
    const Problem problem = MakeLatticeProblem(data);
    ASSERT_TRUE(LeavingBound::Fits(problem));
    LeavingBound bound(problem);
    HypothesisSets sets(problem, false);
    for (std::size_t b = 0; b < oracle.beliefs().size(); ++b) {
      const BruteForce::Belief& belief = oracle.beliefs()[b];
      std::vector<Hypothesis> members;
      for (const int i : belief.members) members.push_back(problem.hypotheses[static_cast<std::size_t>(i)]);
      const auto set = sets.Find(members);
      ASSERT_TRUE(set.has_value());
      const double value =
          bound.Weighted(sets, *set, Cell(belief.robot[0], belief.robot[1], belief.robot[2])) / sets.info(*set).weight;
      ASSERT_LE(value, oracle.values()[b] + 1e-9);
      if (oracle.Goal(belief.members)) {
        EXPECT_EQ(value, 0.0);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, LeavingBoundLaws, ::testing::Range(0, 16));

/// A square or cube of hypotheses, `side` a side, of a target somewhere above and beside the start.
LatticeProblemData ManyHypotheses(const std::vector<Cell>& target, const Cell& sides) {
  LatticeProblemData data;
  data.name = "many hypotheses";
  data.target = target;
  data.tool = {Cell::Zero()};
  data.size = sides + Cell(14, 14, sides.z() > 1 ? 8 : 0);
  for (int x = 0; x < sides.x(); ++x) {
    for (int y = 0; y < sides.y(); ++y) {
      for (int z = 0; z < sides.z(); ++z) {
        data.hypotheses.push_back({Cell(5 + x, 5 + y, sides.z() > 1 ? 3 + z : 0), 0, 1.0});
      }
    }
  }
  data.start = Cell(2, 1, 0);
  return data;
}

std::vector<Cell> Block(int x, int y, int z) {
  std::vector<Cell> cells;
  for (int i = 0; i < x * y * z; ++i) cells.emplace_back(i % x, i / x % y, i / x / y);
  return cells;
}

const std::vector<Cell> kAngle = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, 2, 0}};

TEST(LeavingBoundSolves, ManyHypothesesOfSmallTargets) {
  struct Case {
    std::vector<Cell> target;
    Cell sides;
    double gap;
  };
  for (const Case& c :
       {Case{Block(3, 3, 1), {8, 8, 1}, 1.1}, Case{kAngle, {8, 8, 1}, 1.1}, Case{Block(3, 2, 2), {4, 4, 4}, 1.1},
        Case{Block(3, 3, 1), {11, 11, 1}, 1.2}, Case{kAngle, {11, 11, 1}, 1.2}, Case{Block(3, 2, 2), {5, 5, 5}, 1.2}}) {
    SCOPED_TRACE(std::to_string(c.target.size()) + " of " + std::to_string(c.sides.prod()));
    const Problem problem = MakeLatticeProblem(ManyHypotheses(c.target, c.sides));
    SolverOptions options;
    options.gap = c.gap;
    options.expansion_limit = 30000;
    const SolverResult result = Solve(problem, options);
    ASSERT_TRUE(result.complete());
    EXPECT_LE(result.Ratio(), c.gap * (1.0 + 1e-9));
  }
}

}  // namespace
}  // namespace feeler::planner
