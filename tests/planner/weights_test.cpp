// Laws of problems whose hypotheses have weights, where equal weights are solved first:
//   - the cost is never above what the policy for equal weights costs under the weights, whatever limit holds;
//   - it is the exact cost of the policy returned, the bound is below the optimum and the optimum below the cost
//     (oracle: value iteration, brute_force.h);
//   - limits span both searches, the bounds reported are those of the weighted problem, and a policy that was found
//     before a cancellation is kept.

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "feeler/core/random.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/solve.h"
#include "tests/planner/brute_force.h"
#include "tests/planner/random_problems.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

using testing::BruteForce;
using testing::RandomProblem;

Problem WithEqualWeights(Problem problem) {
  for (Hypothesis& h : problem.hypotheses) h.weight = 1.0;
  return problem;
}

Problem WithRandomWeights(Problem problem, std::uint64_t seed) {
  RandomStream random(seed, 0, "weights of hypotheses");
  for (Hypothesis& h : problem.hypotheses) h.weight = random.Uniform(0.05, 3.0);
  return problem;
}

Problem Plug(const Extents& extents) {
  static const auto map = testing::MakePlugMap();
  return MakeCuboidProblem(testing::MakePlugTask(), map, extents);
}

void ExpectNoDearerThanEqualWeights(const Problem& problem, const SolverOptions& options,
                                    const std::shared_ptr<const PlanningTables>& tables) {
  const SolverResult weighed = Solve(problem, options, tables);
  ASSERT_TRUE(weighed.complete());
  const PolicyEvaluation found = Evaluate(problem, *weighed.policy);
  EXPECT_EQ(found.fault, "");
  EXPECT_NEAR(found.expected_cost, weighed.expected_cost, 1e-9);
  SolverOptions half = options;  // what the first of both searches has
  half.expansion_limit = std::max<std::int64_t>(1, options.expansion_limit / 2);
  const SolverResult equal = Solve(WithEqualWeights(problem), half, tables);
  ASSERT_TRUE(equal.complete());
  EXPECT_LE(weighed.expected_cost, Evaluate(problem, *equal.policy).expected_cost * (1.0 + 1e-12));
}

TEST(Weights, CostNoMoreThanThePolicyForEqualOnes) {
  const auto tables = BuildPlanningTables(Plug({5, 3, 4}), {});  // for all of one map
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const Extents extents{2 + static_cast<int>(seed % 4), 3, 2 + static_cast<int>(seed % 3)};
    for (const std::int64_t limit : {2, 60, 2000}) {
      SolverOptions options;
      options.gap = seed % 2 == 0 ? 1.3 : 1.02;
      options.expansion_limit = limit;
      options.first_policy_in_any_case = true;
      ExpectNoDearerThanEqualWeights(WithRandomWeights(Plug(extents), seed), options, tables);
    }
  }
}

TEST(Weights, OptimumLiesBetweenBoundAndCost) {
  int solved = 0;
  for (std::uint64_t index = 0; index < 60; ++index) {
    const LatticeProblemData data =
        RandomProblem(31, index, {.three_d = index % 3 == 0, .weights = true, .costs = index % 2 == 0});
    Problem problem = MakeLatticeProblem(data);
    problem.generous_workspace = true;
    const BruteForce judge(data);
    if (judge.optimal_cost() == BruteForce::kInfinity) continue;
    for (const double gap : {1.0, 1.5}) {
      SolverOptions options;
      options.gap = gap;
      const SolverResult result = Solve(problem, options);
      if (!result.complete()) continue;  // lost in the space outside of a small workspace
      ++solved;
      EXPECT_EQ(Evaluate(problem, *result.policy).fault, "");
      EXPECT_GE(result.expected_cost, judge.optimal_cost() * (1.0 - 1e-9));
      EXPECT_LE(result.lower_bound, judge.optimal_cost() * (1.0 + 1e-9));
      EXPECT_LE(result.expected_cost, gap * judge.optimal_cost() * (1.0 + 1e-9));
    }
  }
  EXPECT_GT(solved, 60);
}

TEST(Weights, LimitsSpanBothSearches) {
  const Problem problem = WithRandomWeights(Plug({5, 5, 3}), 7);
  SolverOptions options;
  options.gap = 1.0;
  options.expansion_limit = 400;
  const SolverResult equal = Solve(WithEqualWeights(problem), options);
  ASSERT_EQ(equal.status, SolverStatus::kExpansionLimit);
  std::int64_t last = 0;
  double lowest = 0.0;
  options.on_bounds = [&](const BoundsRow& row) {
    EXPECT_GE(row.expansions, last);
    EXPECT_GE(row.lower_bound, lowest - 1e-9);
    last = row.expansions;
    lowest = row.lower_bound;
  };
  const SolverResult result = Solve(problem, options);
  ASSERT_TRUE(result.complete());
  EXPECT_EQ(result.status, SolverStatus::kExpansionLimit);
  EXPECT_GE(result.expansions, options.expansion_limit);
  EXPECT_LE(result.expansions, options.expansion_limit + 100);
  EXPECT_EQ(last, result.expansions);
}

TEST(Weights, CancelledInTheSecondSearchKeepsThePolicyOfTheFirst) {
  const Problem problem = WithRandomWeights(Plug({7, 7, 5}), 3);
  CancellationToken token;
  SolverOptions options;
  options.gap = 1.0;
  options.expansion_limit = 20000;
  options.cancellation = &token;
  options.on_bounds = [&](const BoundsRow&) { token.Cancel(); };  // the first row is one of the second search
  const SolverResult result = Solve(problem, options);
  EXPECT_EQ(result.status, SolverStatus::kCancelled);
  ASSERT_TRUE(result.complete());
  EXPECT_EQ(Evaluate(problem, *result.policy).fault, "");
}

}  // namespace
}  // namespace feeler::planner
