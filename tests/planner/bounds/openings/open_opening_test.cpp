// Laws of planning with an opening that is left open: filling dead ends gives the map of the closed opening, and
// nothing where there is none; certified policies are valid at their stated cost, above their bound, and cost at
// most 1.02 times the closed ones, whatever stops the search. Tasks that cannot be localized are reported with the
// pairs of hypotheses.

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "feeler/planner/contact/fill_dead_ends.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/solve.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

TEST(FillDeadEnds, ClosesAnOpeningAndNothingElse) {
  const auto closed = testing::MakePlugMap(false, {6, 5, 12});
  const auto filled = FillDeadEnds(*testing::MakePlugMap(true, {6, 5, 12}));
  ASSERT_NE(filled, nullptr);
  const CellBox& domain = closed->domain();
  for (int z = domain.min.z(); z <= domain.max.z(); ++z) {
    for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
      for (int x = domain.min.x(); x <= domain.max.x(); ++x) {
        const Cell here(x, y, z);
        ASSERT_EQ(closed->Blocked(here), filled->Blocked(here));
        for (const Direction d : kDirections) ASSERT_EQ(closed->Travel(here, d), filled->Travel(here, d));
      }
    }
  }
  EXPECT_EQ(FillDeadEnds(*closed), nullptr);
}

TEST(OpenOpening, CostsNoMoreThanClosed) {
  const Task task = testing::MakePlugTask();
  const auto open = testing::MakePlugMap(true, {10, 9, 12});
  const auto closed = testing::MakePlugMap(false, {10, 9, 12});
  SolverOptions options;
  options.expansion_limit = 500;
  options.first_policy_in_any_case = true;
  const auto open_tables = BuildPlanningTables(MakeCuboidProblem(task, open, {2, 2, 2}), options);
  const auto closed_tables = BuildPlanningTables(MakeCuboidProblem(task, closed, {2, 2, 2}), options);
  for (const Extents& extents : {Extents{2, 2, 2}, Extents{3, 5, 2}, Extents{7, 6, 5}, Extents{15, 15, 15}}) {
    SCOPED_TRACE(ToString(extents));
    const Problem problem = MakeCuboidProblem(task, open, extents);
    const SolverResult result = Solve(problem, options, open_tables);
    ASSERT_TRUE(result.complete());
    const PolicyEvaluation evaluation = Evaluate(problem, *result.policy);
    EXPECT_EQ(evaluation.fault, "");
    EXPECT_NEAR(evaluation.expected_cost, result.expected_cost, 1e-9);
    EXPECT_LE(result.lower_bound, result.expected_cost);
    const SolverResult reference = Solve(MakeCuboidProblem(task, closed, extents), options, closed_tables);
    EXPECT_LE(result.expected_cost, 1.02 * reference.expected_cost);
  }
}

TEST(Unlocalizable, TaskIsReportedWithItsPairs) {
  // The ends of the walls along y are out of reach: nothing tells that coordinate.
  Task task = testing::MakePlugTask();
  task.workspace_m = Eigen::Vector3d(0.04, 0.04, 0.04);
  const auto map = testing::MakePlugMap(false, {4, 60, 4});
  SolverOptions options;
  const SolverResult result = Solve(MakeCuboidProblem(task, map, {2, 2, 1}), options);
  EXPECT_FALSE(result.complete());
  EXPECT_EQ(result.status, SolverStatus::kUnlocalizable);
  EXPECT_EQ(result.indistinguishable, (std::vector<std::pair<int, int>>{{0, 1}, {2, 3}}));
}

}  // namespace
}  // namespace feeler::planner
