// Oracle: value iteration over all reachable beliefs (brute_force.h). Laws of every heuristic, on every reachable
// belief of random small lattice problems with all kinds of costs, weights and goals: admissible, h <= V*; consistent,
// h(b) <= C(b,a) + sum P h(b') for every action (cuboids promise only the first); zero at goals; of a stated tightness
// on the mean. On closed and open plug maps canonical beliefs have the values of the same beliefs in problem
// coordinates.

#include <gtest/gtest.h>

#include <cmath>

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "tests/planner/brute_force.h"
#include "tests/planner/random_problems.h"

namespace feeler::planner {
namespace {

using testing::BruteForce;
using testing::RandomProblem;
using testing::RandomProblemOptions;

std::vector<Hypothesis> Select(const Problem& problem, const std::vector<int>& members) {
  std::vector<Hypothesis> hypotheses;
  for (const int i : members) hypotheses.push_back(problem.hypotheses[static_cast<std::size_t>(i)]);
  return hypotheses;
}

/// Mean of h / V* that the bounds reach at least on these problems, whatever costs, weights and goal: what a bound is
/// worth is a law of it too (zero is admissible and consistent). The floors are round numbers below what was measured.
double LeastTightness(HeuristicKind kind) {
  switch (kind) {
    case HeuristicKind::kCertificate: return 0.5;
    case HeuristicKind::kCuboids: return 0.5;
    case HeuristicKind::kLines: return 0.3;
    case HeuristicKind::kFirstContact: return 0.1;
  }
  return 1.0;
}

class Heuristics : public ::testing::TestWithParam<std::tuple<HeuristicKind, int, bool>> {};

TEST_P(Heuristics, AdmissibleAndConsistent) {
  const auto [heuristic_kind, kind, generous] = GetParam();
  RandomProblemOptions options;
  options.three_d = (kind & 1) != 0;
  options.weights = (kind & 2) != 0;
  options.costs = (kind & 4) != 0;
  options.insertable = (kind & 8) != 0;
  options.axis_costs = (kind & 16) != 0;
  double sum_of_ratios = 0.0;
  int beliefs = 0;
  for (std::uint64_t index = 0; index < 8; ++index) {
    const LatticeProblemData data = RandomProblem(100 + static_cast<std::uint64_t>(kind), index, options);
    SCOPED_TRACE(data.name);
    const BruteForce oracle(data);
    Problem problem = MakeLatticeProblem(data);
    problem.generous_workspace = generous;  // takes the tables that tasks use
    SolverOptions solver;
    solver.heuristic = heuristic_kind;
    const PlanningTables tables(problem, solver, Parallelism());
    HypothesisSets sets(problem, false);
    const auto heuristic = tables.MakeHeuristic(problem, sets);
    std::vector<double> values;
    for (std::size_t b = 0; b < oracle.beliefs().size(); ++b) {
      const BruteForce::Belief& belief = oracle.beliefs()[b];
      const auto set = sets.Find(Select(problem, belief.members));
      ASSERT_TRUE(set.has_value());
      const Cell robot(belief.robot[0], belief.robot[1], belief.robot[2]);
      values.push_back(heuristic->Weighted(*set, robot) / sets.info(*set).weight);
      ASSERT_LE(values.back(), oracle.values()[b] + 1e-9);
      if (oracle.Goal(belief.members)) {
        EXPECT_EQ(values.back(), 0.0);
      } else if (std::isfinite(oracle.values()[b])) {
        sum_of_ratios += values.back() / oracle.values()[b];
        ++beliefs;
      }
    }
    if (heuristic_kind == HeuristicKind::kCuboids) continue;
    for (std::size_t b = 0; b < values.size(); ++b) {
      for (const BruteForce::Action& action : oracle.actions()[b]) {
        ASSERT_LE(values[b], BruteForce::Q(action, values) + 1e-9);
      }
    }
  }
  const double tightness = sum_of_ratios / beliefs;
  RecordProperty("mean_tightness", std::to_string(tightness));
  // Lines are silent where the prior is not uniform; where setting out costs nothing, the least cost of a cell stands
  // for all axes.
  const bool silent = heuristic_kind == HeuristicKind::kLines && options.weights;
  const double share = options.axis_costs ? 0.2 : 1.0;
  EXPECT_GE(tightness, silent ? 0.0 : share * LeastTightness(heuristic_kind));
}

INSTANTIATE_TEST_SUITE_P(Kinds, Heuristics,
                         ::testing::Combine(::testing::Values(HeuristicKind::kCertificate, HeuristicKind::kCuboids,
                                                              HeuristicKind::kLines, HeuristicKind::kFirstContact),
                                            ::testing::Range(0, 16), ::testing::Bool()));

INSTANTIATE_TEST_SUITE_P(CostsPerAxis, Heuristics,
                         ::testing::Combine(::testing::Values(HeuristicKind::kCertificate, HeuristicKind::kLines,
                                                              HeuristicKind::kFirstContact),
                                            ::testing::Values(16, 20, 21, 23, 28), ::testing::Bool()));

}  // namespace
}  // namespace feeler::planner
