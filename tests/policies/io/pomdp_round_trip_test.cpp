// Laws of the way out and back: every problem of tests/data that is exported, as .pomdp and as .pomdpx, is read back,
// and the general solver finds the optimum that the lattice solver proves; the controller that comes out costs it, too.
// A controller written as JSON reads back the same.
#include <gtest/gtest.h>

#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/search/solve_pomdp.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/io/controller_json.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "feeler/policies/io/pomdp_export.h"

namespace feeler::policies {
namespace {

class RoundTrip : public testing::TestWithParam<std::string> {};

TEST_P(RoundTrip, TheOptimumIsTheLatticeSolvers) {
  const std::string file = std::string(FEELER_SOURCE_DIR) + "/tests/data/" + GetParam() + ".json";
  const planner::Problem problem = planner::MakeLatticeProblem(ReadLatticeProblem(file));
  planner::SolverOptions lattice;
  lattice.gap = 1.0;
  const planner::SolverResult exact = planner::Solve(problem, lattice);
  ASSERT_EQ(exact.status, planner::SolverStatus::kConverged);
  for (const bool factored : {false, true}) {
    const planner::Pomdp pomdp = factored ? planner::ParsePomdpx(FormatPomdpx(problem), "exported.pomdpx")
                                          : planner::ParseCassandraPomdp(FormatPomdp(problem), "exported.pomdp");
    planner::PomdpSolverOptions options;
    options.kind = planner::PomdpSolverOptions::DefaultKind(pomdp);
    options.precision = 1e-7;
    const planner::PomdpResult result = planner::SolvePomdp(pomdp, options);
    EXPECT_NEAR(-result.value_lower, exact.expected_cost, 1e-6);
    EXPECT_NEAR(-result.value_upper, exact.expected_cost, 1e-6);
    ASSERT_TRUE(result.controller);
    const planner::PomdpController again =
        ParseController(FormatController(pomdp, *result.controller, result.value_lower), "controller", pomdp);
    EXPECT_NEAR(-planner::EvaluateController(pomdp, again)->value, exact.expected_cost, 1e-6);
  }
}

// block36 and pocket3d, hundreds of megabytes of text, take a minute or so each; block64, block125 more than 2 GB.
INSTANTIATE_TEST_SUITE_P(Data, RoundTrip, testing::Values("weighted2d", "slot2d", "insertable2d", "lshape2d"));

}  // namespace
}  // namespace feeler::policies
