// Laws of the solvers on plug-like problems: the policy replays validly against the contact map under every hypothesis,
// at the cost the solver states; the lower bound is below it; the inflation bounds the ratio.

#include "feeler/planner/solve.h"

#include <gtest/gtest.h>

#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

TEST(SolvePlug, PoliciesReplayAtTheirCost) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap();
  const SolverOptions options = FastSetting(SolverKind::kRtdpBel, 1.2);
  const auto tables = BuildPlanningTables(MakeCuboidProblem(task, map, {2, 2, 2}), options);
  for (const Extents& extents : {Extents{2, 2, 2}, Extents{7, 7, 7}, Extents{3, 9, 5}, Extents{15, 15, 15}}) {
    SCOPED_TRACE(ToString(extents));
    const Problem problem = MakeCuboidProblem(task, map, extents);
    const SolverResult result = Solve(problem, options, tables);
    ASSERT_TRUE(result.complete()) << ToString(result.status);
    const PolicyEvaluation evaluation = Evaluate(problem, *result.policy);
    EXPECT_EQ(evaluation.fault, "");
    EXPECT_NEAR(evaluation.expected_cost, result.expected_cost, 1e-9);
    EXPECT_LE(result.expected_cost, 1.2 * result.lower_bound + 1e-9);
  }
}

}  // namespace
}  // namespace feeler::planner
