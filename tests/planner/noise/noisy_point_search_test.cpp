// Laws of bounds that beliefs share:
// - at the start they hold the optimum between them, as the search over exact beliefs finds it;
// - the policy that they make costs no more than U where nothing is declared below the confidence asked for;
// - they close gaps that exact beliefs leave open: a pocket in a block, 27 hypotheses, every kind of noise.
#include "feeler/planner/noise/noisy_point_search.h"

#include <gtest/gtest.h>

#include <vector>

#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/noise/noisy_policy.h"
#include "feeler/planner/noise/solve_noisy.h"
#include "tests/planner/noise/lattices.h"
#include "tests/planner/noise/slot.h"

namespace feeler::planner {
namespace {

/// The slot, its places not equally likely.
LatticeProblemData WeightedSlot() {
  LatticeProblemData data = Slot();
  for (Hypothesis& hypothesis : data.hypotheses) hypothesis.weight = 1.0 + hypothesis.offset.x();
  return data;
}

std::optional<SolverStatus> NeverStop(std::int64_t /*expansions*/) { return std::nullopt; }

TEST(NoisyPointSearch, HoldsTheOptimum) {
  for (const Noise& noise : {Noise{0.02, 0.01, 0.01}, Noise{0.1, 0.1, 0.05}, Noise{0.0, 0.1, 0.2}}) {
    LatticeProblemData data = WeightedSlot();
    data.cost = {1.0, 0.25, 0.1};
    const NoisyProblem noisy{MakeLatticeProblem(data), noise, {0.51, 100.0}};
    SolverOptions options;
    options.gap = 1.002;
    options.expansion_limit = 2500;
    const NoisyResult exact = SolveNoisy(noisy, options);

    NoisyBound bound(noisy);
    NoisyBeliefGraph graph(noisy, [&](const Cell& robot, auto belief) { return bound(robot, belief); });
    NoisyPointSearch shared(graph, bound);
    EXPECT_EQ(shared.Run(1.005, NeverStop), std::nullopt);
    EXPECT_LE(shared.Lower(0), exact.evaluation.expected_cost + 1e-6);
    EXPECT_GE(shared.Upper(0), exact.lower_bound - 1e-6);
    EXPECT_LE(shared.Upper(0), 1.005 * shared.Lower(0) + 1e-6);
    for (std::uint32_t b = 0; b < graph.size(); ++b) ASSERT_LE(shared.Lower(b), shared.Upper(b) + 1e-9);

    NoisyEvaluation evaluation;
    FreezeNoisyPolicy(
        graph, [&](std::uint32_t b) { return shared.Move(b); }, 1e-9, &evaluation);
    EXPECT_NEAR(evaluation.right + evaluation.wrong + evaluation.given_up, 1.0, 1e-6);
    EXPECT_LE(evaluation.expected_cost, shared.Upper(0) + 1e-3);
    EXPECT_GE(evaluation.expected_cost, exact.lower_bound - 1e-3);
  }
}

TEST(NoisyPointSearch, ClosesWhatExactBeliefsLeaveOpen) {
  for (const double confidence : {0.6, 0.99}) {
    const NoisyProblem noisy{MakeLatticeProblem(Pocket()), {0.02, 0.01, 0.01}, {confidence, 100.0}};
    SolverOptions options;
    options.gap = 1.01;
    options.expansion_limit = 20'000;
    const NoisyResult result = SolveNoisy(noisy, options);
    EXPECT_LE(result.Ratio(), 1.01 + 1e-6) << confidence;
    for (const NoisyPolicy::Node& node : result.policy.nodes) {
      if (!node.ends() || node.declared.empty()) continue;
      EXPECT_GE(node.confidence, confidence - 1e-9);
    }
  }
}

}  // namespace
}  // namespace feeler::planner
