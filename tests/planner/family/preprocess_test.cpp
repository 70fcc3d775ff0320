// Laws of preprocessing: every problem of the family ends in the sink, once; policies are the same for one and several
// threads, on distant solvers, in parts of the family, and when a run is cut into two; an experience never breaks the
// bound; a cancelled run stores only finished problems; a limit that was set is kept, and only the certified solver is
// given one that was not.

#include "feeler/planner/family/preprocess.h"

#include <gtest/gtest.h>

#include <atomic>
#include <map>

#include "feeler/core/error.h"
#include "feeler/planner/family/family_solver.h"
#include "feeler/planner/policy/evaluate.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

class MemorySink : public PolicySink {
 public:
  bool Done(const Extents& extents) override { return results.contains(extents); }
  std::optional<PolicyGraph> Load(const Extents& extents) override { return results.at(extents).policy; }
  void Store(const Extents& extents, const Problem& problem, const SolverResult& result) override {
    EXPECT_TRUE(results.emplace(extents, result).second);
    ASSERT_TRUE(result.complete());
    EXPECT_EQ(Evaluate(problem, *result.policy).fault, "");
    if (token != nullptr && results.size() == cancel_at) token->Cancel();
  }
  std::map<Extents, SolverResult> results;
  CancellationToken* token = nullptr;
  std::size_t cancel_at = 0;
};

void ExpectSame(const MemorySink& a, const MemorySink& b) {
  ASSERT_EQ(a.results.size(), b.results.size());
  for (const auto& [extents, result] : a.results) {
    SCOPED_TRACE(ToString(extents));
    const SolverResult& other = b.results.at(extents);
    EXPECT_EQ(result.expected_cost, other.expected_cost);
    EXPECT_EQ(result.lower_bound, other.lower_bound);
    EXPECT_EQ(result.expansions, other.expansions);
    ASSERT_EQ(result.policy->nodes.size(), other.policy->nodes.size());
    for (std::size_t i = 0; i < result.policy->nodes.size(); ++i) {
      const PolicyNode& one = result.policy->nodes[i];
      const PolicyNode& two = other.policy->nodes[i];
      EXPECT_EQ(one.move, two.move);
      EXPECT_EQ(one.expected_cost, two.expected_cost);
      ASSERT_EQ(one.branches.size(), two.branches.size());
      for (std::size_t k = 0; k < one.branches.size(); ++k) {
        EXPECT_EQ(one.branches[k].outcome, two.branches[k].outcome);
        EXPECT_EQ(one.branches[k].next, two.branches[k].next);
        EXPECT_EQ(one.branches[k].shift, two.branches[k].shift);
        EXPECT_EQ(one.branches[k].probability, two.branches[k].probability);
      }
      ASSERT_EQ(one.leaf.size(), two.leaf.size());
      for (std::size_t k = 0; k < one.leaf.size(); ++k) {
        EXPECT_EQ(one.leaf[k].offset, two.leaf[k].offset);
        EXPECT_EQ(one.leaf[k].orientation, two.leaf[k].orientation);
      }
    }
  }
}

class Preprocessing : public ::testing::TestWithParam<std::tuple<SolverKind, ProblemOrder>> {};

TEST_P(Preprocessing, SameForAnyThreadsAndAfterResume) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(false, {8, 7, 6});
  const ProblemFamily family = ParseProblemFamily("2..3x2..4x2..3");
  PreprocessOptions options;
  options.solver.solver = std::get<0>(GetParam());
  options.solver.epsilon = 2.0;
  options.order = std::get<1>(GetParam());
  options.tables = BuildPlanningTables(MakeCuboidProblem(task, map, family.problems.front()), options.solver);

  MemorySink serial;
  const PreprocessSummary summary = Preprocess(task, map, family, options, serial);
  EXPECT_EQ(summary.complete, 12);
  EXPECT_EQ(summary.failed, 0);

  options.jobs = Parallelism(3);
  MemorySink parallel;
  Preprocess(task, map, family, options, parallel);
  ExpectSame(serial, parallel);

  CancellationToken token;
  options.cancellation = &token;
  MemorySink resumed;
  resumed.token = &token;
  resumed.cancel_at = 5;
  EXPECT_TRUE(Preprocess(task, map, family, options, resumed).cancelled);
  EXPECT_LT(resumed.results.size(), 12U);
  options.cancellation = nullptr;
  resumed.token = nullptr;
  const PreprocessSummary rest = Preprocess(task, map, family, options, resumed);
  EXPECT_EQ(rest.skipped + rest.complete, 12);
  ExpectSame(serial, resumed);
}

TEST_P(Preprocessing, PartsAreThoseOfTheWhole) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(false, {8, 7, 6});
  const ProblemFamily family = ParseProblemFamily("2..3x2..4x2..3");
  PreprocessOptions options;
  options.solver.solver = std::get<0>(GetParam());
  options.solver.epsilon = 2.0;
  options.order = std::get<1>(GetParam());
  options.jobs = Parallelism(2);
  MemorySink whole;
  Preprocess(task, map, family, options, whole);

  MemorySink parts;
  std::int64_t helpers = 0;
  for (std::size_t part = 0; part < 3; ++part) {
    std::vector<Extents> only;
    for (std::size_t i = part; i < family.problems.size(); i += 3) only.push_back(family.problems[i]);
    MemorySink own;
    options.only = std::make_shared<const std::vector<Extents>>(only);
    const PreprocessSummary summary = Preprocess(task, map, family, options, own);
    EXPECT_EQ(summary.problems, 4);
    EXPECT_EQ(summary.complete, 4);
    helpers += summary.helpers;
    for (const auto& [extents, result] : own.results) EXPECT_TRUE(parts.results.emplace(extents, result).second);
  }
  ExpectSame(whole, parts);
  EXPECT_EQ(helpers > 0, options.solver.solver == SolverKind::kERtdpBel);
}

TEST_P(Preprocessing, DistantSolversChangeNothing) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(false, {8, 7, 6});
  const ProblemFamily family = ParseProblemFamily("2..3x2..4x2..3");
  PreprocessOptions options;
  options.solver.solver = std::get<0>(GetParam());
  options.solver.epsilon = 2.0;
  options.order = std::get<1>(GetParam());
  MemorySink alone;
  Preprocess(task, map, family, options, alone);

  const FamilySolver elsewhere(task, map, family, options);
  std::atomic<int> calls{0};
  for (int i = 0; i < 3; ++i) {
    options.distant.emplace_back([&](const Extents& extents, const std::optional<SimilarProblem>& similar) {
      ++calls;
      return elsewhere.Solve(extents, similar);
    });
  }
  // Who is first is chance: on a busy machine one may do all of a run.
  for (int run = 0; run < 20 && calls == 0; ++run) {
    MemorySink together;
    EXPECT_EQ(Preprocess(task, map, family, options, together).complete, 12);
    ExpectSame(alone, together);
  }
  EXPECT_GT(calls, 0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Preprocessing,
                         ::testing::Combine(::testing::Values(SolverKind::kRtdpBel, SolverKind::kERtdpBel,
                                                              SolverKind::kCertified),
                                            ::testing::Values(ProblemOrder::kUncertainty, ProblemOrder::kRandom)));

TEST(ProblemFamily, ParsesAndOrders) {
  const ProblemFamily family = ParseProblemFamily("2..15x2..15x2..15");
  EXPECT_EQ(family.problems.size(), 2744U);
  const auto order = OrderOf(family, ProblemOrder::kUncertainty, 1);
  for (std::size_t i = 1; i < order.size(); ++i) {
    EXPECT_LE(family.problems[order[i - 1]].Count(), family.problems[order[i]].Count());
  }
  EXPECT_EQ(ParseExtents("7x7x5"), (Extents{7, 7, 5}));
  EXPECT_EQ(ToString(Extents{7, 7, 5}), "7x7x5");
  for (const char* bad : {"", "7x7", "7x7x0", "7x7x-1", "7x7x5x2", "2..1x2x2", "axbxc", "7x7x99", "7x7x5 "}) {
    EXPECT_THROW(ParseProblemFamily(bad), InputError) << bad;
    EXPECT_THROW(ParseExtents(bad), InputError) << bad;
  }
}

TEST(FamilyBudget, KeepsWhatWasSet) {
  const SolverOptions unlimited = FastSetting(SolverKind::kCertified, 1.0);
  const std::int64_t closed = WithFamilyBudget(unlimited).expansion_limit;
  const std::int64_t oriented = WithFamilyBudget(unlimited, {.orientations = true}).expansion_limit;
  const std::int64_t per_axis = WithFamilyBudget(unlimited, {.cells_per_axis = true}).expansion_limit;
  EXPECT_LT(per_axis, closed);
  EXPECT_LT(closed, oriented);
  EXPECT_LT(oriented, unlimited.expansion_limit);
  const auto of_size = [&](const FamilyTraits& family, std::size_t hypotheses) {
    return WithFamilyBudget(unlimited, family, hypotheses).expansion_limit;
  };
  EXPECT_LT(oriented, of_size({.orientations = true}, kSmallOrientedHypotheses));
  EXPECT_EQ(oriented, of_size({.orientations = true}, kSmallOrientedHypotheses + 1));
  EXPECT_EQ(closed, of_size({}, 8)) << "size counts with orientations alone";

  SolverOptions limited = unlimited;
  limited.expansion_limit = 123456;
  EXPECT_EQ(WithFamilyBudget(limited, {.orientations = true}).expansion_limit, 123456);
  limited = unlimited;
  limited.time_limit_s = 10.0;
  EXPECT_EQ(WithFamilyBudget(limited, {.orientations = true}).expansion_limit, unlimited.expansion_limit);
  const SolverOptions other = FastSetting(SolverKind::kRtdpBel, 2.0);
  EXPECT_EQ(WithFamilyBudget(other, {.orientations = true}).expansion_limit, other.expansion_limit);
}

}  // namespace
}  // namespace feeler::planner
