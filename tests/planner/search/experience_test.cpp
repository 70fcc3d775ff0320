// Laws of E-RTDP-Bel:
//  - with an empty experience it is RTDP-Bel, expansion for expansion;
//  - heur^E of the beliefs of B^E is the fixed point of equation 6, found here by brute force over all pairs; heur^E <=
//  epsilon heur everywhere;
//  - heur(b,b') satisfies the triangle inequality and heur(b) <= heur(b,b') + heur(b');
//  - jumps to subsets only lower heur^E;
//  - a policy rolled out from its own start is followed to its end: where epsilon is too large for jumps,
//  heur^E(b_start) is its cost;
//  - with any experience the cost is at most epsilon V* (oracle: value iteration, brute_force.h);
//  - experience saves expansions: with its own policy, and with that of a neighbour, E-RTDP-Bel expands less than
//  RTDP-Bel.

#include "feeler/planner/search/experience.h"

#include <gtest/gtest.h>

#include <cmath>

#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/solve.h"
#include "tests/planner/brute_force.h"
#include "tests/planner/random_problems.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

using testing::BruteForce;
using testing::RandomProblem;

SolverOptions Options(SolverKind solver, double epsilon) {
  SolverOptions options = PaperSetting(solver, epsilon);
  options.heuristic = HeuristicKind::kLines;
  return options;
}

/// The same problem with its last hypothesis left out: a simpler problem to take experience from.
LatticeProblemData Simpler(LatticeProblemData data) {
  data.hypotheses.pop_back();
  return data;
}

double Normalised(const BeliefGraph& graph, BeliefId b) { return graph.Heuristic(b) / graph.Weight(b); }

/// Equation 6 by value iteration over all entries and all jumps.
std::vector<double> FixedPoint(const BeliefGraph& graph, const ExperienceMdp& mdp, double epsilon, JumpKind jumps) {
  const std::size_t n = mdp.entries.size();
  std::vector<double> values(n);
  for (std::size_t i = 0; i < n; ++i) values[i] = epsilon * Normalised(graph, mdp.entries[i].belief);
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < n; ++i) {
      double value = values[i];
      for (std::size_t j = 0; j < n; ++j) {
        value = std::min(
            value, epsilon * JumpHeuristic(graph, mdp.entries[i].belief, mdp.entries[j].belief, jumps) + values[j]);
      }
      for (const auto& transition : mdp.entries[i].transitions) {
        double followed = transition.cost;
        for (const auto& [next, probability] : transition.branches) followed += probability * values[next];
        value = std::min(value, followed);
      }
      changed = changed || value < values[i] - 1e-13;
      values[i] = value;
    }
  }
  return values;
}

TEST(Experience, EmptyExperienceIsRtdpBel) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(false, {8, 7, 6});
  const Problem problem = MakeCuboidProblem(task, map, {3, 2, 4});
  const auto tables = BuildPlanningTables(problem, Options(SolverKind::kRtdpBel, 2.0));
  const SolverResult plain = Solve(problem, Options(SolverKind::kRtdpBel, 2.0), tables);
  const SolverResult with = Solve(problem, Options(SolverKind::kERtdpBel, 2.0), tables);
  ASSERT_TRUE(plain.complete());
  EXPECT_EQ(plain.expansions, with.expansions);
  EXPECT_EQ(plain.trials, with.trials);
  EXPECT_EQ(plain.expected_cost, with.expected_cost);
  EXPECT_EQ(plain.policy->nodes.size(), with.policy->nodes.size());
}

TEST(Experience, HeuristicIsTheFixedPoint) {
  int experiences = 0;
  for (std::uint64_t index = 0; index < 60; ++index) {
    const LatticeProblemData data =
        RandomProblem(7, index, {.three_d = index % 2 == 1, .weights = index % 5 == 0, .costs = index % 3 == 0});
    SCOPED_TRACE(data.name);
    if (data.hypotheses.size() < 3) continue;
    const Problem simpler = MakeLatticeProblem(Simpler(data));
    const Problem problem = MakeLatticeProblem(data);
    const SolverResult solved = Solve(simpler, Options(SolverKind::kRtdpBel, 2.0));
    if (!solved.complete()) continue;
    for (const double epsilon : {1.0, 2.0, 5.0}) {
      for (const int variant : {0, 1, 2, 3}) {
        const bool rollout = variant % 2 == 0;
        const JumpKind jumps = variant < 2 ? JumpKind::kSameHypotheses : JumpKind::kSubsets;
        const PlanningTables tables(problem, Options(SolverKind::kERtdpBel, epsilon));
        BeliefGraph graph(problem, tables.masks(), false);
        const auto heuristic = tables.MakeHeuristic(problem, graph.sets());
        graph.SetHeuristic(heuristic.get());
        const ExperienceMdp mdp = rollout ? RollOut(graph, *solved.policy) : Transplant(graph, simpler, *solved.policy);
        ExperienceHeuristic experience(graph, mdp, epsilon, jumps);
        const std::vector<double> judge = FixedPoint(graph, mdp, epsilon, jumps);
        for (std::size_t i = 0; i < judge.size(); ++i) EXPECT_NEAR(experience.values()[i], judge[i], 1e-9);
        // Beliefs outside B^E: successors of its beliefs.
        for (std::size_t i = 0; i < mdp.entries.size(); ++i) graph.Actions(mdp.entries[i].belief);
        for (BeliefId b = 0; b < std::min<std::size_t>(graph.size(), 200); ++b) {
          double equation_7 = epsilon * Normalised(graph, b);
          EXPECT_LE(experience(b), equation_7 + 1e-9);
          for (std::size_t i = 0; i < judge.size(); ++i) {
            equation_7 =
                std::min(equation_7, epsilon * JumpHeuristic(graph, b, mdp.entries[i].belief, jumps) + judge[i]);
          }
          EXPECT_NEAR(experience(b), equation_7, 1e-9);
        }
        ++experiences;
      }
    }
  }
  EXPECT_GT(experiences, 50);
}

TEST(Experience, JumpsAreConsistent) {
  for (std::uint64_t index = 0; index < 10; ++index) {
    const Problem problem = MakeLatticeProblem(RandomProblem(8, index, {}));
    const PlanningTables tables(problem, Options(SolverKind::kERtdpBel, 2.0));
    BeliefGraph graph(problem, tables.masks(), false);
    const auto heuristic = tables.MakeHeuristic(problem, graph.sets());
    graph.SetHeuristic(heuristic.get());
    const BeliefId start = graph.Start();
    if (start == kNoBelief || !std::isfinite(graph.Heuristic(start))) continue;
    for (BeliefId b = 0; b < graph.size() && graph.size() < 60; ++b) graph.Actions(b);
    const auto count = static_cast<BeliefId>(std::min<std::size_t>(graph.size(), 60));
    const JumpKind jumps = index % 2 == 0 ? JumpKind::kSameHypotheses : JumpKind::kSubsets;
    for (BeliefId a = 0; a < count; ++a) {
      for (BeliefId b = 0; b < count; ++b) {
        const double ab = JumpHeuristic(graph, a, b, jumps);
        EXPECT_LE(Normalised(graph, a), ab + Normalised(graph, b) + 1e-9);
        for (BeliefId c = 0; c < count; ++c) {
          ASSERT_LE(JumpHeuristic(graph, a, c, jumps), ab + JumpHeuristic(graph, b, c, jumps) + 1e-9);
        }
      }
    }
  }
}

TEST(Experience, CostStaysWithinEpsilon) {
  for (std::uint64_t index = 0; index < 40; ++index) {
    const LatticeProblemData data =
        RandomProblem(9, index, {.three_d = index % 2 == 1, .weights = index % 5 == 0, .costs = index % 3 == 0});
    SCOPED_TRACE(data.name);
    if (data.hypotheses.size() < 3) continue;
    const Problem simpler = MakeLatticeProblem(Simpler(data));
    const Problem problem = MakeLatticeProblem(data);
    const SolverResult solved = Solve(simpler, Options(SolverKind::kRtdpBel, 3.0));
    const BruteForce oracle(data);
    if (!solved.complete() || !oracle.IndistinguishablePairs().empty()) continue;
    for (const double epsilon : {1.0, 2.0, 5.0}) {
      for (const ExperienceKind kind : {ExperienceKind::kRollout, ExperienceKind::kNaive}) {
        const SolverResult result =
            Solve(problem, Options(SolverKind::kERtdpBel, epsilon), nullptr, {kind, &simpler, &*solved.policy});
        ASSERT_TRUE(result.complete());
        EXPECT_EQ(Evaluate(problem, *result.policy).fault, "");
        EXPECT_LE(result.expected_cost, epsilon * oracle.optimal_cost() + 1e-7);
        EXPECT_LE(result.lower_bound, oracle.optimal_cost() + 1e-7);
      }
    }
  }
}

TEST(Experience, JumpsToSubsetsOnlyLowerTheHeuristic) {
  for (std::uint64_t index = 0; index < 20; ++index) {
    const LatticeProblemData data = RandomProblem(10, index, {.three_d = index % 2 == 1});
    if (data.hypotheses.size() < 3) continue;
    const Problem problem = MakeLatticeProblem(data);
    const SolverResult solved = Solve(MakeLatticeProblem(Simpler(data)), Options(SolverKind::kRtdpBel, 2.0));
    if (!solved.complete()) continue;
    const PlanningTables tables(problem, Options(SolverKind::kERtdpBel, 2.0));
    BeliefGraph graph(problem, tables.masks(), false);
    const auto heuristic = tables.MakeHeuristic(problem, graph.sets());
    graph.SetHeuristic(heuristic.get());
    const ExperienceMdp mdp = RollOut(graph, *solved.policy);
    ExperienceHeuristic same(graph, mdp, 2.0, JumpKind::kSameHypotheses);
    ExperienceHeuristic subsets(graph, mdp, 2.0, JumpKind::kSubsets);
    for (std::size_t i = 0; i < mdp.entries.size(); ++i) graph.Actions(mdp.entries[i].belief);
    for (BeliefId b = 0; b < graph.size(); ++b) EXPECT_LE(subsets(b), same(b) + 1e-9);
  }
}

TEST(Experience, OwnPolicyIsFollowedToItsEnd) {
  int followed = 0;
  for (std::uint64_t index = 0; index < 30; ++index) {
    const LatticeProblemData data = RandomProblem(11, index, {.three_d = index % 2 == 1, .costs = index % 3 == 0});
    const Problem problem = MakeLatticeProblem(data);
    const SolverResult solved = Solve(problem, Options(SolverKind::kRtdpBel, 2.0));
    if (!solved.complete() || solved.expected_cost <= 0.0) continue;
    const PlanningTables tables(problem, Options(SolverKind::kERtdpBel, 2.0));
    BeliefGraph graph(problem, tables.masks(), false);
    const auto heuristic = tables.MakeHeuristic(problem, graph.sets());
    graph.SetHeuristic(heuristic.get());
    const BeliefId start = graph.Start();
    ExperienceHeuristic experience(graph, RollOut(graph, *solved.policy), 1e6, JumpKind::kSameHypotheses);
    EXPECT_LE(experience(start), solved.expected_cost + 1e-9);
    bool informed = true;
    for (const auto& entry : experience.experience().entries) informed &= graph.Heuristic(entry.belief) > 1e-3;
    if (!informed) continue;
    EXPECT_NEAR(experience(start), solved.expected_cost, 1e-9);
    ++followed;
  }
  EXPECT_GT(followed, 10);
}

/// A regression of speed in expansions, which no machine changes.
TEST(Experience, SavesExpansions) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap();
  const Problem problem = MakeCuboidProblem(task, map, {6, 6, 6});
  const auto tables = BuildPlanningTables(problem, Options(SolverKind::kRtdpBel, 2.0));
  for (const double epsilon : {2.0, 3.0, 5.0}) {
    SCOPED_TRACE(epsilon);
    const SolverResult without = Solve(problem, Options(SolverKind::kRtdpBel, epsilon), tables);
    ASSERT_TRUE(without.complete());
    const SolverResult own = Solve(problem, Options(SolverKind::kERtdpBel, epsilon), tables,
                                   {ExperienceKind::kRollout, &problem, &*without.policy});
    EXPECT_LT(own.expansions, 0.35 * static_cast<double>(without.expansions));
    EXPECT_LE(own.expected_cost, without.expected_cost * (1.0 + 1e-9));
    for (const Extents& neighbour : {Extents{6, 6, 5}, Extents{6, 5, 6}, Extents{5, 6, 6}}) {
      const Problem similar = MakeCuboidProblem(task, map, neighbour);
      const SolverResult solved = Solve(similar, Options(SolverKind::kRtdpBel, epsilon), tables);
      ASSERT_TRUE(solved.complete());
      const SolverResult with = Solve(problem, Options(SolverKind::kERtdpBel, epsilon), tables,
                                      {ExperienceKind::kRollout, &similar, &*solved.policy});
      RecordProperty(ToString(neighbour), static_cast<int>(with.expansions));
      EXPECT_LT(with.expansions, without.expansions) << ToString(neighbour);
    }
  }
}

}  // namespace
}  // namespace feeler::planner
