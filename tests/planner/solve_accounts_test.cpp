// Laws of a solver's accounts, over all attempts at a problem:
//   - the CPU time stated is the process's between call and return (one thread, tables included), the wall time the
//     clock's;
//   - expansions are summed over the attempts, and no limit is passed by an attempt that begins after another;
//   - limits, memory and cancellation hold for the first policy, too, unless it is wanted in any case;
//   - memory counts the tables that are shared; a stop for memory is called so.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include "feeler/core/clock.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/policy/fit_workspace.h"
#include "feeler/planner/policy/freeze_policy.h"
#include "feeler/planner/solve.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

struct Measured {
  SolverResult result;
  double cpu_s = 0.0;
  double wall_s = 0.0;
  int attempts = 0;
};

/// Each attempt ends with a row of its own.
Measured MeasuredSolve(const Problem& problem, SolverOptions options,
                       const std::shared_ptr<const PlanningTables>& tables = nullptr) {
  Measured measured;
  std::int64_t last = -1;
  options.on_bounds = [&](const BoundsRow& row) {
    EXPECT_GE(row.expansions, last);
    last = row.expansions;
  };
  const double cpu_s = ProcessCpuSeconds();
  const auto start = std::chrono::steady_clock::now();
  measured.result = Solve(problem, options, tables);
  measured.cpu_s = ProcessCpuSeconds() - cpu_s;
  measured.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_EQ(last, measured.result.expansions);
  return measured;
}

void ExpectHonestTimes(const Measured& measured) {
  EXPECT_NEAR(measured.result.cpu_s, measured.cpu_s, 0.05 * measured.cpu_s + 0.002);
  EXPECT_NEAR(measured.result.wall_s, measured.wall_s, 0.05 * measured.wall_s + 0.02);
}

/// A problem in whose workspace the first policy does not fit, so that there is a second attempt.
Problem TightProblem() {
  Problem problem = MakeCuboidProblem(testing::MakePlugTask(), testing::MakePlugMap(false, {6, 5, 8}), {6, 5, 3});
  problem.cost.per_action = 0.5;
  const SolverOptions options;
  const SolverResult roomy = Solve(problem, options);
  Problem tight = problem;
  for (; tight.workspace.min.z() < problem.start.z(); ++tight.workspace.min.z()) {
    if (StaysInWorkspace(tight, *roomy.policy)) continue;
    const auto fitted = FitIntoWorkspace(tight, *roomy.policy);
    if (!fitted || fitted->expected_cost > std::max(roomy.expected_cost, options.gap * roomy.lower_bound)) break;
  }
  return tight;
}

TEST(Accounts, TimesAreTheProcess) {
  const Task task = testing::MakePlugTask();
  const Problem problem = MakeCuboidProblem(task, testing::MakePlugMap(), {6, 6, 5});
  for (const SolverKind kind : {SolverKind::kCertified, SolverKind::kRtdpBel}) {
    ExpectHonestTimes(MeasuredSolve(problem, FastSetting(kind, 1.2)));
    const auto tables = BuildPlanningTables(problem, FastSetting(kind, 1.2));
    ExpectHonestTimes(MeasuredSolve(problem, FastSetting(kind, 1.2), tables));
  }
}

TEST(Accounts, SpanBothAttempts) {
  const Problem tight = TightProblem();
  Problem roomy = tight;
  roomy.workspace.min.z() -= 1000;
  SolverOptions options;
  const auto tables = BuildPlanningTables(tight, options);
  const SolverResult first = Solve(roomy, options, tables);
  const Measured both = MeasuredSolve(tight, options, tables);
  ASSERT_TRUE(both.result.complete());
  EXPECT_EQ(Evaluate(tight, *both.result.policy).fault, "");
  EXPECT_GT(both.result.expansions, first.expansions);
  ExpectHonestTimes(both);
  // What the first attempt left of the budget is all that the second has.
  options.expansion_limit = first.expansions + 20;
  const SolverResult limited = Solve(tight, options, tables);
  EXPECT_LE(limited.expansions, options.expansion_limit + 100);
}

TEST(Accounts, LimitsReachTheFirstPolicy) {
  const Task task = testing::MakePlugTask();
  for (const bool open : {false, true}) {
    const Problem problem = MakeCuboidProblem(task, testing::MakePlugMap(open), {9, 9, 9});
    SolverOptions options;
    options.expansion_limit = 3;
    const auto tables = BuildPlanningTables(problem, options);
    const SolverResult stopped = Solve(problem, options, tables);
    EXPECT_EQ(stopped.status, SolverStatus::kExpansionLimit);
    EXPECT_FALSE(stopped.complete());
    EXPECT_LE(stopped.expansions, 100);
    EXPECT_GT(stopped.lower_bound, 0.0);
    options.first_policy_in_any_case = true;
    const SolverResult complete = Solve(problem, options, tables);
    ASSERT_TRUE(complete.complete());
    EXPECT_EQ(Evaluate(problem, *complete.policy).fault, "");

    options = SolverOptions();
    options.time_limit_s = 1e-4;
    const SolverResult late = Solve(problem, options, tables);
    EXPECT_EQ(late.status, SolverStatus::kTimeLimit);
    EXPECT_FALSE(late.complete());
  }
}

TEST(Accounts, CancellationReachesTheFirstPolicyEvenWhereItIsWanted) {
  const Problem problem = MakeCuboidProblem(testing::MakePlugTask(), testing::MakePlugMap(true), {15, 15, 15});
  CancellationToken token;
  SolverOptions options;
  options.first_policy_in_any_case = true;
  const auto tables = BuildPlanningTables(problem, options);
  options.cancellation = &token;
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    token.Cancel();
  });
  const Measured measured = MeasuredSolve(problem, options, tables);
  EXPECT_EQ(measured.result.status, SolverStatus::kCancelled);
  // A complete first policy has evaluated more beliefs than it has hypotheses to tell apart.
  EXPECT_LT(measured.result.expansions, 15 * 15 * 15);
  // Cancelled before: nothing is looked up in tables that may be incomplete.
  EXPECT_EQ(Solve(problem, options).status, SolverStatus::kCancelled);
}

TEST(Accounts, MemoryCountsTheSharedTables) {
  const Problem problem = MakeCuboidProblem(testing::MakePlugTask(), testing::MakePlugMap(), {9, 9, 9});
  SolverOptions options;
  options.gap = 1.0;
  const auto tables = BuildPlanningTables(problem, options);
  EXPECT_GT(tables->bytes(), std::size_t{1} << 20);
  for (const std::size_t room : {std::size_t{0}, std::size_t{1} << 18, std::size_t{4} << 20}) {
    options.memory_limit_bytes = tables->bytes() + room;
    const SolverResult result = Solve(problem, options, tables);
    EXPECT_EQ(result.status, SolverStatus::kMemoryLimit);
    EXPECT_EQ(ToString(result.status), "memory_limit");
    EXPECT_EQ(result.complete(), room > (std::size_t{1} << 20));
  }
}

}  // namespace
}  // namespace feeler::planner
