// Metamorphic laws of the solvers: mirroring or translating a lattice problem leaves V* unchanged; the scale of weights
// does not matter; canonical translation does not change V* of a plug problem; an expansion limit stops with a complete
// policy and a bound below its cost. Bad problems and options are refused with an InputError.

#include <gtest/gtest.h>

#include <limits>

#include "feeler/core/error.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/solve.h"
#include "tests/planner/random_problems.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

SolverOptions Exact() {
  SolverOptions options;
  options.gap = 1.0;
  return options;
}

LatticeProblemData Mirrored(LatticeProblemData data, int axis) {
  for (Cell& c : data.tool) c[axis] = -c[axis];
  for (Cell& c : data.target) c[axis] = -c[axis];
  for (Hypothesis& h : data.hypotheses) h.offset[axis] = data.size[axis] - 1 - h.offset[axis];
  data.start[axis] = data.size[axis] - 1 - data.start[axis];
  return data;
}

TEST(Metamorphic, MirrorsTranslatesAndScales) {
  int solved = 0;
  for (std::uint64_t index = 0; index < 20; ++index) {
    const LatticeProblemData data = testing::RandomProblem(21, index, {.weights = true, .most_hypotheses = 6});
    const SolverResult result = Solve(MakeLatticeProblem(data), Exact());
    LatticeProblemData moved = data;  // the target's own frame is arbitrary
    for (Cell& c : moved.target) c += Cell(40, -3, 2);
    for (Hypothesis& h : moved.hypotheses) {
      h.offset -= Cell(40, -3, 2);
      h.weight *= 17.0;
    }
    for (const LatticeProblemData& other : {Mirrored(data, 0), Mirrored(data, 1), moved}) {
      const SolverResult same = Solve(MakeLatticeProblem(other), Exact());
      EXPECT_EQ(result.status, same.status);
      if (!result.complete()) continue;
      EXPECT_NEAR(result.expected_cost, same.expected_cost, 1e-7);
    }
    solved += result.complete() ? 1 : 0;
  }
  EXPECT_GT(solved, 5);
}

TEST(Metamorphic, CanonicalTranslationIsExact) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(false, {4, 3, 3});
  for (const Extents& extents : {Extents{2, 2, 2}, Extents{3, 2, 1}, Extents{1, 4, 2}}) {
    SolverOptions options = Exact();
    const Problem problem = MakeCuboidProblem(task, map, extents);
    const SolverResult canonical = Solve(problem, options);
    options.canonical_translation = false;
    const SolverResult plain = Solve(problem, options);
    EXPECT_NEAR(canonical.expected_cost, plain.expected_cost, 1e-7);
    EXPECT_EQ(Evaluate(problem, *plain.policy).fault, "");
    for (const PolicyNode& node : plain.policy->nodes) {
      for (const PolicyBranch& branch : node.branches) EXPECT_EQ(branch.shift, Cell(Cell::Zero()));
    }
  }
}

TEST(Metamorphic, AnyBudgetGivesACompletePolicy) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(true, {8, 7, 6});
  const Problem problem = MakeCuboidProblem(task, map, {9, 8, 4});
  double last_cost = std::numeric_limits<double>::infinity();
  for (const std::int64_t limit : {1, 100, 10000}) {
    SolverOptions options = Exact();
    options.expansion_limit = limit;
    options.first_policy_in_any_case = true;
    const SolverResult result = Solve(problem, options);
    ASSERT_TRUE(result.complete());
    EXPECT_EQ(result.status, SolverStatus::kExpansionLimit);
    EXPECT_EQ(Evaluate(problem, *result.policy).fault, "");
    EXPECT_LE(result.lower_bound, result.expected_cost);
    EXPECT_LE(result.expected_cost, last_cost + 1e-9);
    last_cost = result.expected_cost;
  }
}

TEST(BadInput, IsRefused) {
  const LatticeProblemData good = testing::RandomProblem(3, 0, {});
  EXPECT_NO_THROW(MakeLatticeProblem(good));
  const auto refused = [&](auto change) {
    LatticeProblemData bad = good;
    change(bad);
    EXPECT_THROW(MakeLatticeProblem(bad), InputError);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused([](auto& d) { d.size = Cell(-1, 3, 3); });
  refused([](auto& d) { d.size = Cell(1000, 1000, 1000); });
  refused([](auto& d) { d.start = d.size; });
  refused([](auto& d) { d.hypotheses.clear(); });
  refused([](auto& d) { d.hypotheses.push_back(d.hypotheses.front()); });
  refused([](auto& d) { d.hypotheses.front().weight = 0.0; });
  refused([&](auto& d) { d.hypotheses.front().weight = nan; });
  refused([](auto& d) { d.hypotheses.front().offset = d.start - d.target.front() + d.tool.front(); });
  refused([](auto& d) { d.tool.clear(); });
  refused([](auto& d) { d.move_lengths = {}; });
  refused([](auto& d) { d.move_lengths = {2, 1}; });
  refused([](auto& d) { d.cost = {0.0, 1.0, 0.0}; });
  refused([](auto& d) { d.cost.per_cell = -1.0; });
  const Problem problem = MakeLatticeProblem(good);
  const auto refused_option = [&](auto change) {
    SolverOptions options;
    change(options);
    EXPECT_THROW(Solve(problem, options), InputError);
  };
  refused_option([](auto& o) { o.epsilon = 0.9; });
  refused_option([](auto& o) { o.gap = 0.5; });
  refused_option([&](auto& o) { o.gap = nan; });
  refused_option([](auto& o) { o.time_limit_s = 0.0; });
  refused_option([](auto& o) { o.expansion_limit = 0; });
}

}  // namespace
}  // namespace feeler::planner
