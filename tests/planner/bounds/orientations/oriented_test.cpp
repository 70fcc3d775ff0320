// Problems whose hypotheses differ in orientation too. Oracle: value iteration over all reachable beliefs of small
// random problems of two to four orientations. Laws: heuristics are admissible, consistent and zero at goals; the
// certified solver and RTDP-Bel keep their promises; hypotheses that differ in nothing but an orientation that cannot
// be felt are reported; canonical translation is exact; the table over orientations agrees with the table for one; the
// tables of lines are what optimal policies cost; further first policies only improve; the heuristic of canonical
// beliefs is that of the same beliefs in problem coordinates, and is the same after it has forgotten what it prepared.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "feeler/core/error.h"
#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/certificates/certificate_table.h"
#include "feeler/planner/bounds/orientations/oriented_heuristic.h"
#include "feeler/planner/bounds/orientations/oriented_lines.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/policy/freeze_policy.h"
#include "feeler/planner/search/greedy_completion.h"
#include "feeler/planner/search/random_judgement.h"
#include "feeler/planner/solve.h"
#include "tests/planner/oriented_problems.h"
#include "tests/planner/synthetic_pipe.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

using testing::OrientedProblem;
using testing::RandomProblemOptions;
using testing::ValueIteration;

class OrientedHeuristics : public ::testing::TestWithParam<std::tuple<HeuristicKind, int>> {};

TEST_P(OrientedHeuristics, AdmissibleAndConsistent) {
  const auto [heuristic_kind, kind] = GetParam();
  RandomProblemOptions options;
  options.three_d = (kind & 1) != 0;
  options.weights = (kind & 2) != 0;
  options.costs = (kind & 4) != 0;
  options.insertable = (kind & 8) != 0;
  double sum_of_ratios = 0.0;
  int beliefs = 0;
  for (std::uint64_t index = 0; index < 10; ++index) {
    const auto [orientations, pitches] = std::vector<std::pair<int, int>>{{2, 1}, {2, 2}, {3, 1}, {4, 2}}[index % 4];
    const Problem problem =
        OrientedProblem(300 + static_cast<std::uint64_t>(kind), index, options, orientations, pitches);
    SCOPED_TRACE(problem.name);
    const ValueIteration oracle(problem);
    if (!oracle.complete()) continue;
    SolverOptions solver;
    solver.heuristic = heuristic_kind;
    const PlanningTables tables(problem, solver, Parallelism(2));
    HypothesisSets sets(problem, false);
    const auto heuristic = tables.MakeHeuristic(problem, sets);
    std::vector<double> values;
    for (std::size_t b = 0; b < oracle.beliefs().size(); ++b) {
      const auto set = sets.Find(oracle.Hypotheses(b));
      ASSERT_TRUE(set.has_value());
      const auto& robot = oracle.beliefs()[b].robot;
      values.push_back(heuristic->Weighted(*set, Cell(robot[0], robot[1], robot[2])) / sets.info(*set).weight);
      ASSERT_LE(values.back(), oracle.values()[b] + 1e-9);
      if (oracle.Goal(b)) {
        EXPECT_EQ(values.back(), 0.0);
      } else if (std::isfinite(oracle.values()[b])) {
        sum_of_ratios += values.back() / oracle.values()[b];
        ++beliefs;
      }
    }
    for (std::size_t b = 0; b < values.size(); ++b) {
      for (const ValueIteration::Action& action : oracle.actions()[b]) {
        ASSERT_LE(values[b], ValueIteration::Q(action, values) + 1e-9);
      }
    }
  }
  EXPECT_GT(beliefs, 20);
  RecordProperty("mean_tightness", std::to_string(sum_of_ratios / beliefs));
}

INSTANTIATE_TEST_SUITE_P(Kinds, OrientedHeuristics,
                         ::testing::Combine(::testing::Values(HeuristicKind::kCertificate, HeuristicKind::kLines,
                                                              HeuristicKind::kFirstContact),
                                            ::testing::Range(0, 16)));

TEST(Oriented, SolversKeepTheirPromises) {
  int solved = 0;
  for (std::uint64_t index = 0; index < 80; ++index) {
    const Problem problem = OrientedProblem(77, index, {.three_d = index % 2 == 1, .weights = index % 3 == 0},
                                            2 + static_cast<int>(index % 3), 1 + static_cast<int>(index % 2));
    const ValueIteration oracle(problem);
    if (!oracle.complete()) continue;
    const double optimum = oracle.values().front();
    for (const double epsilon : {1.0, 2.0}) {
      SolverOptions options;
      options.gap = epsilon;
      options.epsilon = epsilon;
      for (const SolverKind kind : {SolverKind::kCertified, SolverKind::kRtdpBel}) {
        options.solver = kind;
        const SolverResult result = Solve(problem, options);
        if (!std::isfinite(optimum)) {
          EXPECT_EQ(result.status, SolverStatus::kUnlocalizable);
          EXPECT_FALSE(result.indistinguishable.empty());
          continue;
        }
        ASSERT_TRUE(result.complete());
        EXPECT_EQ(Evaluate(problem, *result.policy).fault, "");
        EXPECT_GE(result.expected_cost, optimum - 1e-7);
        EXPECT_LE(result.expected_cost, epsilon * optimum + 1e-7);
        EXPECT_LE(result.lower_bound, optimum + 1e-7);
        ++solved;
      }
    }
  }
  EXPECT_GT(solved, 20);
}

TEST(Oriented, AnglesThatCannotBeFeltAreReported) {
  // A plug's map in two equal layers.
  const auto plug = testing::MakePlugMap(false, {4, 3, 3});
  const auto map = std::make_shared<ContactMap>(
      plug->domain(), std::vector<ContactMap::Layer>{plug->CopyOfLayer(0), plug->CopyOfLayer(0)}, plug->phase(), 0.5);
  Task task = testing::MakePlugTask();
  task.axes.push_back({AxisKind::kYaw, 0.05, 2, 2});
  const Problem problem = MakeCuboidProblem(task, map, {2, 1, 1, 2, 1});
  for (const SolverKind kind : {SolverKind::kCertified}) {
    SolverOptions options;
    options.solver = kind;
    const SolverResult result = Solve(problem, options);
    EXPECT_EQ(result.status, SolverStatus::kUnlocalizable);
    EXPECT_EQ(result.indistinguishable, (std::vector<std::pair<int, int>>{{0, 1}, {2, 3}}));
  }
  EXPECT_TRUE(Solve(MakeCuboidProblem(task, map, {2, 2, 1, 1, 1}), SolverOptions()).complete());
}

TEST(Oriented, CanonicalTranslationIsExact) {
  const Task task = [] {
    Task small = testing::MakePipeTask(4, 2);
    small.start_offset_m = Eigen::Vector3d(0.004, 0.0, 0.008);
    small.workspace_m = Eigen::Vector3d(0.06, 0.05, 0.03);
    return small;
  }();
  const auto map = testing::MakePipeMap(task, 0.35);
  for (const Extents& extents : {Extents{2, 2, 1, 2, 2}, Extents{3, 1, 1, 1, 2}}) {
    const Problem problem = MakeCuboidProblem(task, map, extents);
    SolverOptions options;
    options.gap = 1.0;
    const SolverResult canonical = Solve(problem, options);
    options.canonical_translation = false;
    const SolverResult plain = Solve(problem, options);
    ASSERT_TRUE(canonical.complete());
    ASSERT_TRUE(plain.complete());
    EXPECT_NEAR(canonical.expected_cost, plain.expected_cost, 1e-7);
    EXPECT_EQ(Evaluate(problem, *canonical.policy).fault, "");
  }
}

TEST(Oriented, TheTableAgreesWithTheOneForOneOrientation) {
  const auto map = testing::MakePlugMap(false, {5, 4, 3});
  const Task task = testing::MakePlugTask();
  Problem problem = MakeCuboidProblem(task, map, {3, 3, 3});
  const StepCosts costs = LowerStepCosts(task.cost, 16);
  const CertificateTable one(*map, costs, Cell::Zero());
  const StepFlagsGrid flags(*map, Parallelism(1));
  const OrientedCertificates table(problem, flags, costs, Parallelism(1), {});
  ASSERT_EQ(table.neighbours().size(), 6U);
  RandomStream random(5, 0, "displacements");
  const CellBox& domain = map->domain();
  for (int i = 0; i < 20000; ++i) {
    Cell at;
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] =
          domain.min[axis] - 3 + static_cast<int>(random.Index(static_cast<std::uint64_t>(domain.Size()[axis] + 6)));
    }
    if (map->Blocked(at)) continue;
    const auto mask = static_cast<int>(random.Index(64));
    const OrientedBox& box = table.box(0);
    const std::uint8_t value = table.PlaneOf(0, static_cast<unsigned>(mask))[box.Index(at)];
    const std::uint32_t with_way = value + (mask == 0 ? 0 : box.WayBack(at));
    ASSERT_EQ(with_way, one.Further(at, mask, 0)) << at.transpose() << " mask " << mask;
  }
}

TEST(Oriented, WhatIsForgottenIsPreparedAgain) {
  Task task = testing::MakePipeTask(2, 4);
  task.start_offset_m = Eigen::Vector3d(0.006, 0.0, 0.008);
  task.workspace_m = Eigen::Vector3d(0.05, 0.044, 0.022);
  const Problem problem = MakeCuboidProblem(task, testing::MakePipeMap(task, 0.25), {2, 2, 1, 3, 3});
  const StepCosts costs = LowerStepCosts(task.cost, problem.move_lengths.back());
  const auto flags = std::make_shared<const StepFlagsGrid>(*problem.map, Parallelism(1));
  const auto table = std::make_shared<const OrientedCertificates>(problem, *flags, costs, Parallelism(1), nullptr);
  const auto lines = std::make_shared<const OrientedLines>(problem, *flags, costs, Parallelism(1), nullptr);
  const auto pairs = std::make_shared<const OrientedPairs>(flags, costs);
  const ContactMasks masks(*problem.map);
  BeliefGraph graph(problem, masks, true);
  OrientedHeuristic keeps(problem, graph.sets(), table, pairs, lines);
  OrientedHeuristic forgets(problem, graph.sets(), table, pairs, lines);
  forgets.LimitPrepared(1000);
  graph.SetHeuristic(&keeps);
  GreedyCompletion<BeliefGraph> greedy(graph);
  ASSERT_FALSE(greedy.Run(graph.Start(), [](std::int64_t) { return std::optional<SolverStatus>(); }));
  for (BeliefId b = 0; b < graph.size(); ++b) {
    ASSERT_EQ(forgets.Weighted(graph.set(b), graph.robot(b)), graph.Heuristic(b));
  }
  EXPECT_LT(forgets.bytes(), keeps.bytes() / 2);
}

TEST(Oriented, LinesCostWhatTheBestPolicyDoes) {
  // Where only distance costs, the tables are exact: the cost of the policy that is found for a line alone, which no
  // lower bound can be above and no policy below.
  Task task = testing::MakePipeTask(2, 4);
  task.start_offset_m = Eigen::Vector3d(0.006, 0.0, 0.008);
  task.workspace_m = Eigen::Vector3d(0.05, 0.044, 0.022);
  const auto map = testing::MakePipeMap(task, 0.25);
  const Problem whole = MakeCuboidProblem(task, map, {1, 1, 1, 4, 4});
  const OrientedLines lines(whole, StepFlagsGrid(*map, Parallelism(1)),
                            LowerStepCosts(task.cost, whole.move_lengths.back()), Parallelism(1), {});
  SolverOptions options;
  options.gap = 1.0;
  const auto tables = BuildPlanningTables(whole, options, Parallelism(2));
  RandomStream random(17, 0, "lines");
  int compared = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const OrientedLines::Axis axis = trial % 2 == 0 ? OrientedLines::kYaw : OrientedLines::kPitch;
    const int across = static_cast<int>(random.Index(4));
    Problem problem = whole;
    problem.hypotheses.clear();
    unsigned subset = 0;
    int line = -1;
    for (int k = 0; k < 4; ++k) {
      if (random.Index(3) == 0) continue;
      const int orientation = axis == OrientedLines::kYaw ? k * whole.pitches + across : across * whole.pitches + k;
      const OrientedLines::Place place = lines.PlaceOf(axis, orientation);
      ASSERT_TRUE(line < 0 || line == place.line);
      line = place.line;
      subset |= 1U << place.bit;
      problem.hypotheses.push_back({Cell::Zero(), orientation});
    }
    const auto count = static_cast<double>(problem.hypotheses.size());
    if (count < 2) continue;
    problem.start = whole.start + Cell(static_cast<int>(random.Index(9)) - 4, static_cast<int>(random.Index(9)) - 4,
                                       static_cast<int>(random.Index(5)));
    if (std::ranges::any_of(problem.hypotheses,
                            [&](const Hypothesis& h) { return Blocked(problem, problem.start, h); })) {
      continue;
    }
    const SolverResult result = Solve(problem, options, tables);
    const OrientedBox& box = lines.box(line);
    const std::uint16_t value = lines.PlaneOf(line, subset)[box.Index(problem.start)];
    if (!result.complete()) {
      EXPECT_EQ(value, OrientedLines::kNone);
      continue;
    }
    EXPECT_NEAR(value + count * box.WayBack(problem.start), count * result.expected_cost, 1e-6) << trial;
    ++compared;
  }
  EXPECT_GT(compared, 20);
}

Task SmallPipeTask(int yaws, int pitches) {
  Task task = testing::MakePipeTask(yaws, pitches);
  task.start_offset_m = Eigen::Vector3d(0.006, 0.0, 0.01);
  task.workspace_m = Eigen::Vector3d(0.06, 0.05, 0.026);
  return task;
}

TEST(Oriented, FurtherFirstPoliciesOnlyImprove) {
  const Task task = SmallPipeTask(3, 3);
  const auto map = testing::MakePipeMap(task, 0.35);
  const Problem problem = MakeCuboidProblem(task, map, {3, 2, 1, 3, 3});
  const PlanningTables tables(problem, SolverOptions(), Parallelism(2));
  BeliefGraph graph(problem, tables.masks(), true);
  const auto heuristic = tables.MakeHeuristic(problem, graph.sets());
  graph.SetHeuristic(heuristic.get());
  GreedyCompletion<BeliefGraph> greedy(graph);
  const BeliefId start = graph.Start();
  const auto never = [](std::int64_t) { return std::optional<SolverStatus>(); };
  ASSERT_FALSE(greedy.Run(start, never).has_value());
  double before = greedy.Value(start);
  int improved = 0;
  for (std::uint64_t number = 0; number < 12; ++number) {
    ASSERT_FALSE(greedy.Run(start, never, RandomJudgement(graph, 1, number)).has_value());
    const double value = greedy.Value(start);
    ASSERT_LE(value, before);
    improved += value < before ? 1 : 0;
    before = value;
    const PolicyGraph policy = FreezePolicy(graph, [&](BeliefId b) {
      const BeliefAction& action = graph.Actions(b)[static_cast<std::size_t>(greedy.Action(b))];
      return GuardedMove{action.direction, action.cells};
    });
    EXPECT_EQ(Evaluate(problem, policy).fault, "");
    EXPECT_LE(policy.expected_cost, value / graph.Weight(start) + 1e-9)
        << "each belief's best, whatever run it is from";
  }
  EXPECT_GT(improved, 0);
}

TEST(Oriented, JudgementsDifferAndRepeat) {
  const Task task = SmallPipeTask(2, 2);
  const Problem problem = MakeCuboidProblem(task, testing::MakePipeMap(task, 0.35), {3, 2, 1, 2, 2});
  const PlanningTables tables(problem, SolverOptions(), Parallelism(2));
  BeliefGraph graph(problem, tables.masks(), true);
  const auto heuristic = tables.MakeHeuristic(problem, graph.sets());
  graph.SetHeuristic(heuristic.get());
  const BeliefId start = graph.Start();
  const double bits = std::log2(static_cast<double>(problem.hypotheses.size()));
  std::set<double> guesses;
  for (std::uint64_t number = 0; number < 20; ++number) {
    const auto judgement = RandomJudgement(graph, 5, number);
    const double guess = judgement.guess(start);
    EXPECT_GE(guess, graph.Heuristic(start));
    EXPECT_LE(guess, 2.0 * graph.Heuristic(start) + 2.0 * bits * graph.Weight(start));
    EXPECT_EQ(guess, RandomJudgement(graph, 5, number).guess(start)) << "same seed, same number";
    guesses.insert(guess);
    std::array<double, 3> along{};
    for (const BeliefAction& action : graph.Actions(start)) {
      const double factor = judgement.cost(action) / action.cost;
      EXPECT_GE(factor, 0.6);
      EXPECT_LE(factor, 1.65);
      double& known = along[static_cast<std::size_t>(AxisOf(action.direction))];
      if (known > 0.0) {
        EXPECT_NEAR(factor, known, 1e-12) << "one factor an axis";
      }
      known = factor;
    }
  }
  EXPECT_EQ(guesses.size(), 20U);
  EXPECT_NE(RandomJudgement(graph, 5, 0).guess(start), RandomJudgement(graph, 6, 0).guess(start));
}

}  // namespace
}  // namespace feeler::planner
