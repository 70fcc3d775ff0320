// A law of limits of time: what the searches of noisy problems, the policy and its replay take together stays within
// them, wherever they strike.
#include <gtest/gtest.h>

#include "feeler/core/clock.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/noise/solve_noisy.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

TEST(Accounts, NoisySolverKeepsItsTimeLimit) {
  const auto map = testing::MakePlugMap();
  for (const int n : {4, 7}) {
    const NoisyProblem noisy{MakeCuboidProblem(testing::MakePlugTask(), map, {n, n, n}), {0.02, 0.01, 0.01}, {}};
    for (const double limit_s : {0.5, 1.0, 2.0}) {
      SolverOptions options;
      options.gap = 1.0001;
      options.cpu_limit_s = limit_s;
      const double begin_s = ThreadCpuSeconds();
      const NoisyResult result = SolveNoisy(noisy, options);
      EXPECT_EQ(result.status, SolverStatus::kTimeLimit);
      EXPECT_LE(ThreadCpuSeconds() - begin_s, 1.25 * limit_s + 0.2) << n << "^3 hypotheses, limit " << limit_s << " s";
      if (limit_s >= 2.0) {
        EXPECT_LE(result.Ratio(), 1.3) << n;
      }
    }
  }
}

}  // namespace
}  // namespace feeler::planner
