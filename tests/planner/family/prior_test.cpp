// Laws of priors over hypotheses: masses of a normal distribution over cells, axis by axis, more at the middle than
// outside, the same to both sides, one in all; without deviations nothing changes; a policy that was solved for the
// prior costs less under it than the one for equal weights; what makes no sense is refused.
#include "feeler/planner/family/prior.h"

#include <gtest/gtest.h>

#include <cmath>

#include "feeler/core/error.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/solve.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

TEST(Prior, MassesOfCells) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap();
  const Extents extents{5, 3, 2};
  Problem problem = MakeCuboidProblem(task, map, extents);
  WeighByPrior(task, {}, extents, problem);
  for (const Hypothesis& h : problem.hypotheses) EXPECT_EQ(h.weight, 1.0);
  const double cell = task.cell_m;
  WeighByPrior(task, {cell, 2.0 * cell, 0.5 * cell}, extents, problem);
  double total = 0.0;
  const auto at = [&](int x, int y, int z) {
    for (const Hypothesis& h : problem.hypotheses) {
      if (h.offset == Cell(x, y, z)) return h.weight;
    }
    return -1.0;
  };
  for (const Hypothesis& h : problem.hypotheses) {
    total += h.weight;
    EXPECT_NEAR(h.weight, at(4 - h.offset.x(), 2 - h.offset.y(), 1 - h.offset.z()), 1e-15);
  }
  EXPECT_NEAR(total, 1.0, 1e-12);
  EXPECT_GT(at(2, 1, 0), at(1, 1, 0));
  EXPECT_GT(at(1, 1, 0), at(0, 1, 0));
  // One deviation is one cell along x: the cell in the middle has erf(1 / (2 sqrt 2)) of what five cells have.
  const double middle = std::erf(0.5 / std::sqrt(2.0)) / std::erf(2.5 / std::sqrt(2.0));
  EXPECT_NEAR((at(2, 1, 0) + at(2, 0, 0) + at(2, 2, 0)) * 2.0, 0.95 * middle + 0.05 / 5.0, 1e-12);
}

TEST(Prior, IsWorthKnowing) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap();
  const Extents extents{5, 5, 3};
  const Problem even = MakeCuboidProblem(task, map, extents);
  Problem weighed = even;
  WeighByPrior(task, {0.7 * task.cell_m, 0.7 * task.cell_m, 0.7 * task.cell_m}, extents, weighed);
  SolverOptions options;
  options.gap = 1.05;
  options.expansion_limit = 5000;
  const SolverResult plain = Solve(even, options);
  const SolverResult knowing = Solve(weighed, options);
  ASSERT_TRUE(plain.complete() && knowing.complete());
  const double unaware = Evaluate(weighed, *plain.policy).expected_cost;
  EXPECT_NEAR(Evaluate(weighed, *knowing.policy).expected_cost, knowing.expected_cost, 1e-9);
  EXPECT_LT(knowing.expected_cost, 0.97 * unaware);
  EXPECT_LE(knowing.lower_bound, unaware);
}

TEST(Prior, RefusesWhatMakesNoSense) {
  const Task task = testing::MakePlugTask();
  const Extents extents{2, 2, 2};
  Problem problem = MakeCuboidProblem(task, testing::MakePlugMap(), extents);
  for (const std::vector<double>& deviation :
       {std::vector<double>{0.001}, {0.001, 0.001, 0.0}, {0.001, 0.001, std::nan("")}}) {
    EXPECT_THROW(WeighByPrior(task, deviation, extents, problem), InputError);
  }
}

}  // namespace
}  // namespace feeler::planner
