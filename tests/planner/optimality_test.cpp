// Oracle: value iteration over all reachable beliefs, from the definitions (brute_force.h). Laws, on random small
// lattice problems in 2-D and 3-D, with and without weights, contact and action costs, and both goals:
//  - RTDP-Bel at epsilon e: expected cost <= e V*, lower bound <= V*; at e = 1 both equal V*.
//  - the certified solver at gap g: V* <= cost <= g V*, lower bound <= V*.
//  - every policy replays validly, at the stated cost.
//  - unlocalizable problems are reported with exactly the pairs that a search over pairs finds.

#include <gtest/gtest.h>

#include <cmath>

#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/solve.h"
#include "tests/planner/brute_force.h"
#include "tests/planner/random_problems.h"

namespace feeler::planner {
namespace {

using testing::BruteForce;
using testing::RandomProblem;
using testing::RandomProblemOptions;

constexpr double kTolerance = 1e-7;

void ExpectSound(const Problem& problem, const SolverResult& result, double optimal, double factor) {
  ASSERT_TRUE(result.complete()) << ToString(result.status);
  const PolicyEvaluation evaluation = Evaluate(problem, *result.policy);
  EXPECT_EQ(evaluation.fault, "");
  EXPECT_NEAR(evaluation.expected_cost, result.expected_cost, kTolerance);
  EXPECT_GE(result.expected_cost, optimal - kTolerance);
  EXPECT_LE(result.expected_cost, factor * optimal + kTolerance);
  EXPECT_LE(result.lower_bound, optimal + kTolerance);
  EXPECT_LE(result.expected_cost, factor * result.lower_bound + kTolerance);
}

class Optimality : public ::testing::TestWithParam<int> {};

TEST_P(Optimality, SolversKeepTheirPromises) {
  const int kind = GetParam();
  RandomProblemOptions options;
  options.three_d = (kind & 1) != 0;
  options.weights = (kind & 2) != 0;
  options.costs = (kind & 4) != 0;
  options.insertable = (kind & 8) != 0;
  options.axis_costs = (kind & 16) != 0;
  int localizable = 0;
  for (std::uint64_t index = 0; index < 25; ++index) {
    const LatticeProblemData data = RandomProblem(static_cast<std::uint64_t>(kind), index, options);
    SCOPED_TRACE(data.name);
    const BruteForce oracle(data);
    const Problem problem = MakeLatticeProblem(data);
    const auto pairs = oracle.IndistinguishablePairs();
    SolverOptions solver;
    solver.solver = SolverKind::kRtdpBel;
    for (const double epsilon : {1.0, 1.5, 3.0}) {
      solver.epsilon = epsilon;
      const SolverResult result = Solve(problem, solver);
      if (!pairs.empty()) {
        EXPECT_EQ(result.status, SolverStatus::kUnlocalizable);
        EXPECT_EQ(result.indistinguishable, pairs);
        EXPECT_TRUE(std::isinf(oracle.optimal_cost()));
        continue;
      }
      ExpectSound(problem, result, oracle.optimal_cost(), epsilon);
    }
    if (!pairs.empty()) continue;
    ++localizable;
    solver.solver = SolverKind::kCertified;
    for (const double gap : {1.0, 1.3}) {
      solver.gap = gap;
      ExpectSound(problem, Solve(problem, solver), oracle.optimal_cost(), gap);
    }
  }
  EXPECT_GE(localizable, 5);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Optimality, ::testing::Range(0, 16));
INSTANTIATE_TEST_SUITE_P(CostsPerAxis, Optimality, ::testing::Values(16, 21, 28));

}  // namespace
}  // namespace feeler::planner
