// Policies found as if the workspace were unbounded, made to stay in a tight one. Laws: the result is a valid policy of
// the tight problem; where actions cost nothing it costs the same, else its stated costs are the replayed ones; a
// policy that stays inside is left as it is; where the tool itself must leave there is no such policy.

#include "feeler/planner/policy/fit_workspace.h"

#include <gtest/gtest.h>

#include <utility>

#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/policy/freeze_policy.h"
#include "feeler/planner/solve.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

TEST(FitWorkspace, MovesThatEndInContactsAreMadeInPieces) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(false, {6, 5, 8});
  for (const auto& [per_action, extents] : {std::pair{0.0, Extents{5, 4, 3}}, std::pair{0.5, Extents{5, 4, 3}},
                                            // The panel is hit from one height: a last piece would tell nothing.
                                            std::pair{0.0, Extents{5, 4, 1}}, std::pair{0.0, Extents{7, 7, 1}}}) {
    Problem problem = MakeCuboidProblem(task, map, extents);
    problem.cost.per_action = per_action;
    const SolverResult result = Solve(problem, SolverOptions());
    ASSERT_TRUE(result.complete());
    int mended = 0;
    // The workspace shrinks from below until the tool no longer reaches what it must touch.
    for (; problem.workspace.min.z() < problem.start.z(); ++problem.workspace.min.z()) {
      const std::optional<PolicyGraph> fitted = FitIntoWorkspace(problem, *result.policy);
      if (StaysInWorkspace(problem, *result.policy)) {
        ASSERT_TRUE(fitted.has_value());
        EXPECT_EQ(fitted->nodes.size(), result.policy->nodes.size());
        EXPECT_NEAR(fitted->expected_cost, result.expected_cost, 1e-9);
        continue;
      }
      if (!fitted) continue;
      ++mended;
      const PolicyEvaluation evaluation = Evaluate(problem, *fitted);
      EXPECT_EQ(evaluation.fault, "");
      EXPECT_NEAR(fitted->expected_cost, evaluation.expected_cost, 1e-9);
      EXPECT_GE(fitted->nodes.size(), result.policy->nodes.size());
      if (per_action == 0.0) {
        EXPECT_NEAR(fitted->expected_cost, result.expected_cost, 1e-9);
      } else {
        EXPECT_GE(fitted->expected_cost, result.expected_cost - 1e-9);
      }
    }
    EXPECT_GT(mended, 0);
    EXPECT_FALSE(FitIntoWorkspace(problem, *result.policy).has_value());
  }
}

}  // namespace
}  // namespace feeler::planner
