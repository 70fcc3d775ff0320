// Oracle: value iteration over all reachable beliefs (brute_force.h). Laws of the bound for openings, on every
// reachable belief of random lattice problems with slots, pockets and blocks with holes, under all kinds of costs and
// goals: at most the optimal cost; zero at goals; silent where the prior is not uniform. On plug maps it does not
// depend on the frame, and policies cost at least as much. The policy for openings is complete, acyclic, and costs what
// it says; it is no worse than the closed one, and walks the tour through the openings where that is cheaper.

#include <gtest/gtest.h>

#include <memory>

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/openings/open_heuristic.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/solve.h"
#include "tests/planner/brute_force.h"
#include "tests/planner/random_problems.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

using testing::BruteForce;
using testing::Draw;

struct Kind {
  bool costs = false;
  bool insertable = false;
};

/// A block with one or two holes a cell wide, and a few hypotheses beside each other.
LatticeProblemData BlockWithHoles(std::uint64_t index, const Kind& kind) {
  RandomStream random(21, index, "block with holes");
  LatticeProblemData data;
  data.name = "block " + std::to_string(index);
  const int half = random.Uniform() < 0.7 ? 1 : 2;
  const int nx = Draw(random, 2, 3);
  const int nz = Draw(random, 1, 2);
  const int ny = nz == 2 ? 1 : Draw(random, 1, 2);
  data.size = Cell(nx + 2 * half + 2, ny + 4, 4);
  data.tool = {Cell::Zero()};
  const int hole_x = Draw(random, -half + 1, half - 1);
  const bool sideways = random.Uniform() < 0.3;
  const bool second = half > 1 && random.Uniform() < 0.3;
  for (int x = -half; x <= half; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -4; z <= -1; ++z) {
        if (x == hole_x && y == 0 && z >= -2) continue;
        if (second && x == hole_x + 2 && y == 0 && z == -1) continue;
        if (sideways && z == -2 && y == 0 && x < hole_x) continue;
        data.target.emplace_back(x, y, z);
      }
    }
  }
  for (int x = 0; x < nx; ++x) {
    for (int y = 0; y < ny; ++y) {
      for (int z = 0; z < nz; ++z) data.hypotheses.push_back({Cell(x + half + 1, y + 2, z + 2), 0, 1.0});
    }
  }
  data.start = Cell(Draw(random, 0, data.size.x() - 1), Draw(random, 0, data.size.y() - 1), 3);
  data.move_lengths = {1, 2, 4};
  if (kind.costs) data.cost = {1.0, random.Uniform(0.0, 3.0), random.Uniform(0.0, 3.0)};
  if (kind.insertable) {
    data.goal = GoalKind::kInsertable;
    data.insertable_spread = Cell(1, 0, 0);
  }
  return data;
}

struct Tally {
  int positive = 0;
  int best = 0;  ///< no less than certificates
};

class NoBound final : public BeliefHeuristic {
 public:
  double Weighted(SetId /*set*/, const Cell& /*robot*/) override { return 0.0; }
};

void CheckAdmissible(const LatticeProblemData& data, Tally& tally) {
  SCOPED_TRACE(data.name);
  const BruteForce oracle(data);
  Problem problem = MakeLatticeProblem(data);
  problem.generous_workspace = true;  // takes the tables that tasks use
  const PlanningTables tables(problem, SolverOptions());
  if (!tables.filled().map) return;
  HypothesisSets sets(problem, false);
  OpenHeuristic looks(sets, std::make_unique<NoBound>(), tables.filled().map, tables.filled().looks);
  // A table for few hypotheses bounds many by parts.
  const ContactMasks masks(*tables.filled().map);
  OpenHeuristic parts(sets, std::make_unique<NoBound>(), tables.filled().map,
                      std::make_shared<const LookTable>(
                          LookTable::Source{*tables.filled().map, masks, tables.filled().openings},
                          MotionCosts(problem.cost, problem.move_lengths),
                          problem.goal == GoalKind::kInsertable ? problem.insertable_spread : Cell(Cell::Zero()),
                          Cell(2, 2, 1), Parallelism(1)));
  const auto heuristic = tables.MakeHeuristic(problem, sets);
  for (std::size_t b = 0; b < oracle.beliefs().size(); ++b) {
    const BruteForce::Belief& belief = oracle.beliefs()[b];
    std::vector<Hypothesis> members;
    for (const int i : belief.members) members.push_back(problem.hypotheses[static_cast<std::size_t>(i)]);
    const auto set = sets.Find(members);
    ASSERT_TRUE(set.has_value());
    const Cell robot(belief.robot[0], belief.robot[1], belief.robot[2]);
    const double weight = sets.info(*set).weight;
    const double bound = looks.Weighted(*set, robot) / weight;
    const double both = heuristic->Weighted(*set, robot) / weight;
    ASSERT_LE(both, oracle.values()[b] + 1e-9) << "robot " << robot.transpose() << ", " << members.size();
    ASSERT_LE(bound, both + 1e-9);
    ASSERT_LE(parts.Weighted(*set, robot) / weight, oracle.values()[b] + 1e-9);
    if (oracle.Goal(belief.members) || !sets.uniform()) {
      ASSERT_EQ(bound, 0.0);
    }
    if (bound > 0.0) ++tally.positive;
    if (sets.uniform() && bound >= both && bound > 0.0) ++tally.best;
  }
}

class OpenBounds : public ::testing::TestWithParam<Kind> {};

TEST_P(OpenBounds, BlocksWithHoles) {
  Tally tally;
  for (std::uint64_t index = 0; index < 12; ++index) CheckAdmissible(BlockWithHoles(index, GetParam()), tally);
  EXPECT_GT(tally.positive, 1000);
  EXPECT_GT(tally.best, 20);
}

TEST_P(OpenBounds, RandomProblems) {
  Tally tally;
  for (const bool three_d : {false, true}) {
    testing::RandomProblemOptions options;
    options.three_d = three_d;
    options.costs = GetParam().costs;
    options.insertable = GetParam().insertable;
    for (std::uint64_t index = 0; index < 30; ++index) CheckAdmissible(RandomProblem(300, index, options), tally);
    options.weights = true;
    for (std::uint64_t index = 0; index < 5; ++index) CheckAdmissible(RandomProblem(301, index, options), tally);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, OpenBounds,
                         ::testing::Values(Kind{false, false}, Kind{true, false}, Kind{false, true}, Kind{true, true}));

TEST(OpenBound, IsTightForFewAndForMany) {
  const Task task = testing::MakePlugTask();
  const auto open = testing::MakePlugMap(true, {10, 9, 12});
  SolverOptions options;
  options.expansion_limit = 1;
  options.first_policy_in_any_case = true;
  const auto tables = BuildPlanningTables(MakeCuboidProblem(task, open, {15, 15, 2}), options);
  for (const auto& [extents, ratio] : {std::pair{Extents{3, 3, 2}, 1.1},
                                       {Extents{4, 4, 4}, 1.1},
                                       {Extents{4, 7, 3}, 1.1},
                                       {Extents{9, 8, 2}, 1.05},
                                       {Extents{15, 15, 2}, 1.15}}) {
    SCOPED_TRACE(ToString(extents));
    const Problem problem = MakeCuboidProblem(task, open, extents);
    const SolverResult result = Solve(problem, options, tables);
    ASSERT_TRUE(result.complete());
    EXPECT_LE(result.lower_bound, result.expected_cost);
    EXPECT_LE(result.Ratio(), ratio);
    const PolicyEvaluation evaluation = Evaluate(problem, *result.policy);
    EXPECT_EQ(evaluation.fault, "");
    EXPECT_NEAR(evaluation.expected_cost, result.expected_cost, 1e-9);
    // The bound depends on the displacement of the tool alone.
    const HypothesisSets sets(problem, true);
    const HypothesisSets absolute(problem, false);
    EXPECT_NEAR(tables->MakeHeuristic(problem, sets)->Weighted(sets.start(), problem.start - sets.start_frame()),
                tables->MakeHeuristic(problem, absolute)->Weighted(absolute.start(), problem.start), 1e-9);
  }
}

TEST(OpenPolicy, ToursTheOpeningsWhereThatIsCheaper) {
  // A layer of 5 x 5 openings, 12 cells below the tool: the tour costs 12 + 12 and a cell into the opening on average,
  // the closed policy far more.
  Task task = testing::MakePlugTask();
  const auto open = testing::MakePlugMap(true);
  SolverOptions options;
  options.expansion_limit = 1;
  options.first_policy_in_any_case = true;
  const SolverResult result = Solve(MakeCuboidProblem(task, open, {5, 5, 1}), options);
  ASSERT_TRUE(result.complete());
  EXPECT_LE(result.expected_cost, 12.0 + 12.0 + 1.0);
}

}  // namespace
}  // namespace feeler::planner
