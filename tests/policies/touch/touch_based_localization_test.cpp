// Laws of touch-based localization:
// - with all actions sampled it equals a greedy choice made by brute force: no action has a larger expected information
//   gain (gain per cost, weight ruled out per cost) than the one chosen, and the chosen one has what the policy thinks.
//   The brute force walks every way cell by cell and shares nothing with the policy but the definition of an action;
// - no approach can meet contact under any hypothesis; every probe can;
// - every truth is localized, by every criterion, and the walk ends;
// - draws are keyed by seed and episode: same key, same walk;
// - the cost grows from choosing by cost, over ignoring it, to choosing at random; it never falls below the optimum.
#include "feeler/policies/touch/touch_based_localization.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/touch/kinematic_walk.h"
#include "tests/policies/block_problem.h"

namespace feeler::policies {
namespace {

TouchOptions Options(TouchCriterion criterion, int actions) {
  TouchOptions options;
  options.criterion = criterion;
  options.actions = actions;
  options.vicinity_cells = 3;
  options.longest_probe = 6;
  return options;
}

double Score(TouchCriterion criterion, const TouchValue& value) {
  if (criterion == TouchCriterion::kInformationGain) return value.information_gain;
  const double worth = criterion == TouchCriterion::kPruningPerCost ? value.pruned : value.information_gain;
  return worth / std::max(value.cost, 1e-6);
}

/// Values by definition: every hypothesis plays the move cell by cell.
class BruteForceGreedy {
 public:
  BruteForceGreedy(const planner::Problem& problem, const TouchOptions& options)
      : problem_(problem), options_(options) {}

  double Best(const Belief& belief) const {
    double best = 0.0;
    for (int x = problem_.workspace.min.x(); x <= problem_.workspace.max.x(); ++x) {
      for (int y = problem_.workspace.min.y(); y <= problem_.workspace.max.y(); ++y) {
        for (int z = problem_.workspace.min.z(); z <= problem_.workspace.max.z(); ++z) {
          const auto approach = Approach(belief, Cell(x, y, z));
          if (!approach) continue;
          for (const Direction d : kDirections) {
            const int cells = FarthestContact(belief, Cell(x, y, z), d) + 1;
            if (cells < 1) continue;
            const TouchValue value = Value(belief, Cell(x, y, z), *approach, {d, cells});
            best = std::max(best, Score(options_.criterion, value));
          }
        }
      }
    }
    return best;
  }

  TouchValue Value(const Belief& belief, const Cell& pose, double approach_cost, const GuardedMove& probe) const {
    std::map<std::pair<int, bool>, double> groups;
    double total = 0.0;
    TouchValue value;
    for (const Hypothesis& h : belief.hypotheses) {
      const Outcome outcome = planner::Simulate(problem_, pose, probe, h);
      groups[{outcome.cells, outcome.contact}] += h.weight;
      total += h.weight;
      value.cost += h.weight * problem_.cost.Of(outcome, probe.direction);
    }
    value.cost = approach_cost + value.cost / total;
    for (const auto& [outcome, weight] : groups) {
      value.information_gain -= weight / total * std::log(weight / total);
      value.pruned += weight / total * (1.0 - weight / total);
    }
    return value;
  }

 private:
  /// Cells to the farthest contact within the longest probe; -1 if there is none.
  int FarthestContact(const Belief& belief, const Cell& pose, Direction d) const {
    int farthest = -1;
    for (int n = 1; n <= options_.longest_probe && problem_.workspace.Contains(pose + n * UnitCell(d)); ++n) {
      for (const Hypothesis& h : belief.hypotheses) {
        const Outcome outcome = planner::Simulate(problem_, pose, {d, n}, h);
        if (outcome.contact) farthest = std::max(farthest, outcome.cells);
      }
    }
    return farthest;
  }
  /// Cost of the shortest approach; the block stands on a floor, so that the only way around leads over it.
  std::optional<double> Approach(const Belief& belief, const Cell& pose) const {
    std::vector<std::vector<Cell>> ways;
    std::array<int, 3> order = {0, 1, 2};
    do {
      std::vector<Cell> corners = {belief.robot};
      for (const int axis : order) {
        Cell next = corners.back();
        next[axis] = pose[axis];
        corners.push_back(next);
      }
      ways.push_back(corners);
    } while (std::next_permutation(order.begin(), order.end()));
    int over = belief.robot.z();
    for (const Hypothesis& h : belief.hypotheses) over = std::max(over, h.offset.z());
    const Cell& r = belief.robot;
    ways.push_back({r, Cell(r.x(), r.y(), over), Cell(pose.x(), r.y(), over), Cell(pose.x(), pose.y(), over), pose});
    for (const std::vector<Cell>& way : ways) {
      if (Free(belief, way)) return Cost(way);
    }
    return std::nullopt;
  }
  bool Free(const Belief& belief, const std::vector<Cell>& corners) const {
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      Cell at = corners[i];
      if (!problem_.workspace.Contains(corners[i + 1])) return false;
      while (at != corners[i + 1]) {
        const Cell step = (corners[i + 1] - at).cwiseMax(-1).cwiseMin(1);
        for (const Hypothesis& h : belief.hypotheses) {
          if (planner::Blocked(problem_, at + step, h)) return false;
        }
        at += step;
      }
    }
    return true;
  }
  double Cost(const std::vector<Cell>& corners) const {
    double cost = 0.0;
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      const int cells = (corners[i + 1] - corners[i]).cwiseAbs().sum();
      const Direction any = kDirections[0];  // distance: all axes cost the same
      if (cells > 0) cost += problem_.cost.Of({cells, false}, any);
    }
    return cost;
  }

  const planner::Problem& problem_;
  const TouchOptions& options_;
};

class Greedy : public testing::TestWithParam<TouchCriterion> {};

TEST_P(Greedy, EqualsBruteForceOnEveryBeliefOfAWalk) {
  planner::Problem problem = SmallBlockProblem({2, 3, 2});
  problem.cost = {1.0, 0.5, 0.25};
  for (std::size_t i = 0; i < problem.hypotheses.size(); ++i) problem.hypotheses[i].weight = 1.0 + 0.1 * (i % 3);
  const TouchOptions options = Options(GetParam(), 0);
  const BruteForceGreedy brute(problem, options);
  TouchBasedLocalization policy(options, nullptr, 1, 0);
  policy.Begin(problem);
  Belief belief{problem.start, problem.hypotheses};
  const Hypothesis truth = problem.hypotheses[7];
  int steps = 0;
  while (!planner::IsGoal(problem, belief.hypotheses)) {
    ASSERT_LT(++steps, 12);
    const auto action = policy.Choose(belief);
    ASSERT_TRUE(action);
    double approach_cost = 0.0;
    for (const GuardedMove& leg : action->approach) {
      for (const Hypothesis& h : belief.hypotheses) {
        ASSERT_FALSE(planner::Simulate(problem, belief.robot, leg, h).contact);
      }
      approach_cost += problem.cost.Of({leg.cells, false}, leg.direction);
      belief.robot += leg.cells * UnitCell(leg.direction);
    }
    const double chosen = Score(options.criterion, brute.Value(belief, belief.robot, approach_cost, action->probe));
    Belief before = belief;
    for (const GuardedMove& leg : action->approach) before.robot -= leg.cells * UnitCell(leg.direction);
    EXPECT_NEAR(chosen, brute.Best(before), 1e-9) << "step " << steps;
    const Outcome outcome = planner::Simulate(problem, belief.robot, action->probe, truth);
    std::erase_if(belief.hypotheses, [&](const Hypothesis& h) {
      return !(planner::Simulate(problem, belief.robot, action->probe, h) == outcome);
    });
    belief.robot += outcome.cells * UnitCell(action->probe.direction);
  }
}

INSTANTIATE_TEST_SUITE_P(Criteria, Greedy,
                         testing::Values(TouchCriterion::kInformationGain, TouchCriterion::kInformationGainPerCost,
                                         TouchCriterion::kPruningPerCost));

double MeanCost(const planner::Problem& problem, TouchCriterion criterion) {
  double sum = 0.0;
  for (std::size_t i = 0; i < problem.hypotheses.size(); ++i) {
    TouchBasedLocalization policy(Options(criterion, 100), nullptr, 1, i);
    const KinematicWalk walk = Walk(problem, policy, problem.hypotheses[i]);
    EXPECT_TRUE(walk.localized) << walk.reason;
    sum += walk.cost;
  }
  return sum / static_cast<double>(problem.hypotheses.size());
}

TEST(TouchBasedLocalizationTest, LocalizesEveryTruthAtCostsInOrder) {
  const planner::Problem problem = SmallBlockProblem({3, 3, 3});
  const planner::SolverResult optimum =
      planner::Solve(problem, planner::FastSetting(planner::SolverKind::kCertified, 1.0));
  const double per_cost = MeanCost(problem, TouchCriterion::kInformationGainPerCost);
  const double gain = MeanCost(problem, TouchCriterion::kInformationGain);
  const double any = MeanCost(problem, TouchCriterion::kAny);
  EXPECT_GE(per_cost, optimum.lower_bound - 1e-9);
  EXPECT_LT(per_cost, gain);
  EXPECT_LT(gain, any);
  EXPECT_LT(MeanCost(problem, TouchCriterion::kPruningPerCost), gain);
}

TEST(TouchBasedLocalizationTest, SameKeySameWalk) {
  const planner::Problem problem = SmallBlockProblem({4, 4, 3});
  const auto cost = [&](std::uint64_t seed, std::uint64_t episode) {
    TouchBasedLocalization policy(Options(TouchCriterion::kInformationGain, 20), nullptr, seed, episode);
    const double first = Walk(problem, policy, problem.hypotheses[11]).cost;
    EXPECT_EQ(Walk(problem, policy, problem.hypotheses[11]).cost, first) << "Begin erases the past";
    return first;
  };
  EXPECT_EQ(cost(3, 5), cost(3, 5));
  std::map<double, int> costs;
  for (std::uint64_t episode = 0; episode < 8; ++episode) ++costs[cost(3, episode)];
  EXPECT_GT(costs.size(), 1U);
}

TEST(TouchBasedLocalizationTest, NextIsRepeatableAndGivesUpWhereNothingTells) {
  planner::Problem problem = SmallBlockProblem({2, 2, 2});
  TouchBasedLocalization policy(Options(TouchCriterion::kInformationGain, 30), nullptr, 1, 0);
  policy.Begin(problem);
  const Belief belief{problem.start, problem.hypotheses};
  const auto first = std::get<GuardedMove>(policy.Next(belief));
  EXPECT_EQ(std::get<GuardedMove>(policy.Next(belief)), first);
  EXPECT_TRUE(std::holds_alternative<Insert>(policy.Next({problem.start, {problem.hypotheses[0]}})));
  // A workspace of one cell has no move.
  problem.workspace = {problem.start, problem.start};
  policy.Begin(problem);
  EXPECT_TRUE(std::holds_alternative<GiveUp>(policy.Next(belief)));
}

TEST(TouchBasedLocalizationTest, RefusesOptionsOutOfRange) {
  EXPECT_THROW(TouchBasedLocalization(Options(TouchCriterion::kAny, -1), nullptr, 1, 0), InputError);
  TouchOptions options = Options(TouchCriterion::kAny, 1);
  options.longest_probe = 0;
  EXPECT_THROW(TouchBasedLocalization(options, nullptr, 1, 0), InputError);
}

}  // namespace
}  // namespace feeler::policies
