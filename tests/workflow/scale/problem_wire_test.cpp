// Law: what one rank writes another reads, every number bit for bit; anything else is an error, not a result.
#include "feeler/workflow/scale/problem_wire.h"

#include <gtest/gtest.h>

#include "feeler/core/error.h"
#include "feeler/policies/io/policy_blob.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::workflow {
namespace {

planner::SolverResult Solved() {
  const Task task = planner::testing::MakePlugTask();
  const planner::ProblemFamily family = planner::ParseProblemFamily("2..3x3x3");
  const planner::FamilySolver solver(task, planner::testing::MakePlugMap(false, {8, 7, 6}), family, {});
  return solver.Solve(family.problems.back(), std::nullopt);
}

TEST(ProblemWire, ResultsComeBackWhole) {
  const planner::SolverResult result = Solved();
  ASSERT_TRUE(result.complete());
  const planner::SolverResult read = SolverResultFrom(ToBytes(result));
  EXPECT_EQ(read.status, result.status);
  EXPECT_EQ(read.expected_cost, result.expected_cost);
  EXPECT_EQ(read.lower_bound, result.lower_bound);
  EXPECT_EQ(read.expansions, result.expansions);
  EXPECT_EQ(read.trials, result.trials);
  EXPECT_EQ(read.cpu_s, result.cpu_s);
  ASSERT_TRUE(read.complete());
  EXPECT_EQ(policies::EncodePolicyBlob(*read.policy), policies::EncodePolicyBlob(*result.policy));
  planner::SolverResult without = result;
  without.policy.reset();
  without.status = planner::SolverStatus::kTimeLimit;
  EXPECT_FALSE(SolverResultFrom(ToBytes(without)).complete());
  EXPECT_EQ(SolverResultFrom(ToBytes(without)).status, planner::SolverStatus::kTimeLimit);
}

TEST(ProblemWire, RequestsComeBackWhole) {
  planner::SolverResult result = Solved();
  const auto policy = std::make_shared<const planner::PolicyGraph>(std::move(*result.policy));
  const ProblemRequest alone = ProblemRequestFrom(ToBytes(ProblemRequest{{3, 1, 4, 1, 5}, std::nullopt}));
  EXPECT_EQ(alone.extents, (planner::Extents{3, 1, 4, 1, 5}));
  EXPECT_FALSE(alone.similar.has_value());
  const ProblemRequest both =
      ProblemRequestFrom(ToBytes(ProblemRequest{{3, 4, 3, 1, 1}, planner::SimilarProblem{{3, 3, 3, 1, 1}, policy}}));
  ASSERT_TRUE(both.similar.has_value());
  EXPECT_EQ(both.similar->extents, (planner::Extents{3, 3, 3, 1, 1}));
  EXPECT_EQ(policies::EncodePolicyBlob(*both.similar->policy), policies::EncodePolicyBlob(*policy));
}

TEST(ProblemWire, DamageIsAnError) {
  const std::string bytes = ToBytes(Solved());
  for (std::size_t length : {std::size_t{0}, std::size_t{1}, std::size_t{20}, bytes.size() - 1}) {
    EXPECT_THROW(SolverResultFrom(bytes.substr(0, length)), Error) << length;
  }
  for (std::size_t at = 60; at < bytes.size(); at += 17) {
    std::string altered = bytes;
    altered[at] = static_cast<char>(altered[at] ^ 0x10);
    EXPECT_THROW(SolverResultFrom(altered), Error) << at;
  }
}

}  // namespace
}  // namespace feeler::workflow
