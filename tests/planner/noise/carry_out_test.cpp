// Laws of policies that know of no noise in a noisy world: without noise they cost what they promise and declare
// rightly; with noise they are never cheaper than the bound of the noisy problem; on missed contacts alone they declare
// rightly all the same (the tool falls short and is seen to).
#include "feeler/planner/noise/carry_out.h"

#include <gtest/gtest.h>

#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/noise/solve_noisy.h"
#include "feeler/planner/solve.h"
#include "tests/planner/random_problems.h"

namespace feeler::planner {
namespace {

TEST(CarryOut, CostsWhatTheNoiseMakesOfIt) {
  int solved = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    testing::RandomProblemOptions kinds;
    kinds.weights = seed % 2 == 1;
    const Problem problem = MakeLatticeProblem(testing::RandomProblem(22, seed, kinds));
    SolverOptions options;
    options.canonical_translation = false;
    const SolverResult sure = Solve(problem, options);
    if (!sure.complete()) continue;
    ++solved;
    const NoisyEvaluation exact = CarryOut({problem, {}, {}}, *sure.policy);
    EXPECT_NEAR(exact.expected_cost, sure.expected_cost, 1e-9);
    EXPECT_NEAR(exact.right, 1.0, 1e-12);
    const NoisyEvaluation missed = CarryOut({problem, {0.2, 0.0, 0.0}, {}}, *sure.policy);
    EXPECT_NEAR(missed.right, 1.0, 1e-12);
    EXPECT_GE(missed.expected_cost, exact.expected_cost - 1e-9);
    const NoisyProblem noisy{problem, {0.05, 0.1, 0.1}, {}};
    const NoisyEvaluation carried = CarryOut(noisy, *sure.policy);
    EXPECT_NEAR(carried.right + carried.wrong + carried.given_up, 1.0, 1e-12);
    options.expansion_limit = 200;
    EXPECT_GE(carried.expected_cost, SolveNoisy(noisy, options).lower_bound - 1e-9);
  }
  EXPECT_GT(solved, 6);
}

}  // namespace
}  // namespace feeler::planner
