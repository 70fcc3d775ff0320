// A law of limits of time: what the searches of noisy problems, the policy and its replay take together stays within
// them, wherever they strike.
#include <gtest/gtest.h>

#include "feeler/core/clock.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/noise/solve_noisy.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

// The law is one of ratios: what a limit of nothing takes (the tables, which no limit interrupts) is measured in the
// same run, and the limits are multiples of it, so that a slow machine is judged by its own speed.
TEST(Accounts, NoisySolverKeepsItsTimeLimit) {
  const auto map = testing::MakePlugMap();
  for (const int n : {4, 7}) {
    const NoisyProblem noisy{MakeCuboidProblem(testing::MakePlugTask(), map, {n, n, n}), {0.02, 0.01, 0.01}, {}};
    NoisyResult result;
    const auto took_s = [&](double limit_s) {
      SolverOptions options;
      options.gap = 1.0001;
      options.cpu_limit_s = limit_s;
      const double begin_s = ThreadCpuSeconds();
      result = SolveNoisy(noisy, options);
      return ThreadCpuSeconds() - begin_s;
    };
    const double tables_s = took_s(1e-6);
    EXPECT_EQ(result.status, SolverStatus::kTimeLimit);
    for (const double times : {1.0, 2.0, 4.0}) {
      const double limit_s = times * tables_s;
      EXPECT_LE(took_s(limit_s), 1.25 * limit_s + tables_s) << n << "^3 hypotheses, limit " << limit_s << " s";
      EXPECT_EQ(result.status, SolverStatus::kTimeLimit);
    }
    EXPECT_LE(result.Ratio(), 1.3) << n;
  }
}

}  // namespace
}  // namespace feeler::planner
