// Oracle: value iteration over the beliefs of one problem, moves simulated against its contact map one by one
// (`MapOracle` below). Laws of the bound for isolated hypotheses, on random maps with slanted walls (the travel of each
// direction is drawn apart, so that hypotheses may differ along diagonals only), both goals and all kinds of costs:
// admissible and consistent, alone and within the heuristics that use it; exact but for the last step for two
// hypotheses where only distance costs. A table is the same from any thread. On a map with cut corners RTDP-Bel
// converges within few expansions.

#include "feeler/planner/bounds/certificates/pair_certificates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <thread>
#include <utility>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/planner/solve.h"
#include "tests/planner/random_problems.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The map of an obstacle in which every step next to it may also be blocked (a slanted wall cuts the corner between
/// two free cells): extra walls are drawn per cell and direction.
std::shared_ptr<const ContactMap> SlantedMap(RandomStream& random) {
  const CellBox domain{Cell(-6, -6, 0), Cell(6, 6, 0)};
  const auto blocked = [&](const Cell& c) { return std::abs(c.x()) + std::abs(c.y()) <= 1; };
  ContactMap::Layer layer;
  const auto count = static_cast<std::size_t>(domain.Count());
  std::array<std::vector<char>, kDirectionCount> wall;
  for (auto& w : wall) w.assign(count, 0);
  const Cell size = domain.Size();
  const auto index = [&](const Cell& c) {
    const Cell at = c - domain.min;
    return static_cast<std::size_t>(at.y() * size.x() + at.x());
  };
  layer.blocked.assign(count, 0);
  for (auto& travel : layer.travel) travel.assign(count, 0.0F);
  for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
    for (int x = domain.min.x(); x <= domain.max.x(); ++x) {
      const Cell here(x, y, 0);
      layer.blocked[index(here)] = blocked(here) ? 1 : 0;
      for (const Direction d : kDirections) {
        if (AxisOf(d) == 2) continue;
        const Cell next = here + UnitCell(d);
        const bool near = std::max(std::abs(x), std::abs(y)) <= 2;
        if (blocked(next) || (near && random.Uniform() < 0.3))
          wall[static_cast<std::size_t>(IndexOf(d))][index(here)] = 1;
      }
    }
  }
  for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
    for (int x = domain.min.x(); x <= domain.max.x(); ++x) {
      if (blocked(Cell(x, y, 0))) continue;
      for (const Direction d : kDirections) {
        Cell here(x, y, 0);
        float travel = ContactMap::kUnlimited;
        for (float steps = 0.5F; AxisOf(d) != 2 && domain.Contains(here); steps += 1.0F, here += UnitCell(d)) {
          if (wall[static_cast<std::size_t>(IndexOf(d))][index(here)] == 0) continue;
          travel = steps;
          break;
        }
        layer.travel[static_cast<std::size_t>(IndexOf(d))][index(Cell(x, y, 0))] = travel;
      }
    }
  }
  std::vector<ContactMap::Layer> layers;
  layers.push_back(std::move(layer));
  return std::make_shared<ContactMap>(domain, std::move(layers), Eigen::Vector3d::Zero(), 0.5);
}

Problem SlantedProblem(std::uint64_t index, bool costs, bool insertable, int hypotheses) {
  RandomStream random(11, index, "slanted problem");
  Problem problem;
  problem.name = "slanted " + std::to_string(index);
  problem.map = SlantedMap(random);
  while (static_cast<int>(problem.hypotheses.size()) < hypotheses) {
    const Cell h(testing::Draw(random, -1, 1), testing::Draw(random, -1, 1), 0);
    bool known = false;
    for (const Hypothesis& other : problem.hypotheses) known = known || other.offset == h;
    if (!known) problem.hypotheses.push_back({h, 0, 1.0});
  }
  problem.start = Cell(testing::Draw(random, -4, 4), 4, 0);
  problem.workspace = {Cell(-4, -4, 0), Cell(4, 4, 0)};
  problem.move_lengths = {1, 2, 4};
  if (costs) problem.cost = {1.0, random.Uniform(0.0, 4.0), random.Uniform(0.0, 4.0)};
  if (insertable) {
    problem.goal = GoalKind::kInsertable;
    problem.insertable_spread = Cell(1, 0, 0);
  }
  Validate(problem);
  return problem;
}

/// Least expected cost of every reachable belief, by sweeps from above, straight from `Simulate`.
class MapOracle {
 public:
  using Key = std::pair<std::array<int, 2>, std::vector<int>>;  ///< robot, indices of hypotheses
  struct Action {
    double cost = 0.0;
    std::vector<std::pair<std::size_t, double>> next;
  };

  explicit MapOracle(const Problem& problem) : problem_(problem) {
    std::vector<int> all;
    for (std::size_t i = 0; i < problem.hypotheses.size(); ++i) all.push_back(static_cast<int>(i));
    Find({{problem.start.x(), problem.start.y()}, all});
    for (std::size_t b = 0; b < keys.size(); ++b) Expand(b);
    values.assign(keys.size(), kInfinity);
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t b = keys.size(); b-- > 0;) {
        double best = goal[b] ? 0.0 : kInfinity;
        for (const Action& action : actions[b]) best = std::min(best, Q(action, values));
        changed = changed || best < values[b] - 1e-12;
        values[b] = std::min(values[b], best);
      }
    }
  }

  static double Q(const Action& action, const std::vector<double>& of) {
    double q = action.cost;
    for (const auto& [next, probability] : action.next) q += probability * of[next];
    return q;
  }
  std::vector<Hypothesis> Members(std::size_t b) const {
    std::vector<Hypothesis> members;
    for (const int i : keys[b].second) members.push_back(problem_.hypotheses[static_cast<std::size_t>(i)]);
    return members;
  }

  std::vector<Key> keys;
  std::vector<bool> goal;
  std::vector<std::vector<Action>> actions;
  std::vector<double> values;

 private:
  std::size_t Find(const Key& key) {
    const auto [at, added] = index_.try_emplace(key, keys.size());
    if (added) {
      keys.push_back(key);
      actions.emplace_back();
      goal.push_back(IsGoal(problem_, Members(keys.size() - 1)));
    }
    return at->second;
  }
  void Expand(std::size_t b) {
    if (goal[b]) return;
    const auto [robot, members] = keys[b];
    const Cell here(robot[0], robot[1], 0);
    for (const Direction d : kDirections) {
      for (const int cells : problem_.move_lengths) {
        if (!problem_.workspace.Contains(here + cells * UnitCell(d))) continue;
        std::map<std::pair<int, bool>, std::vector<int>> groups;
        for (const int i : members) {
          const Outcome o = Simulate(problem_, here, {d, cells}, problem_.hypotheses[static_cast<std::size_t>(i)]);
          groups[{o.cells, o.contact}].push_back(i);
        }
        if (groups.size() == 1 && groups.begin()->first.first == 0) continue;
        Action action;
        for (const auto& [outcome, group] : groups) {
          const double share = static_cast<double>(group.size()) / static_cast<double>(members.size());
          action.cost += share * problem_.cost.Of({outcome.first, outcome.second}, d);
          const Cell next = here + outcome.first * UnitCell(d);
          action.next.emplace_back(Find({{next.x(), next.y()}, group}), share);
        }
        actions[b].push_back(action);
      }
    }
  }

  const Problem& problem_;
  std::map<Key, std::size_t> index_;
};

Cell SpreadOf(const Problem& problem) {
  return problem.goal == GoalKind::kInsertable ? problem.insertable_spread : Cell(Cell::Zero());
}

struct Kind {
  bool costs;
  bool insertable;
};
class SlantedWalls : public ::testing::TestWithParam<Kind> {};

TEST_P(SlantedWalls, BoundsAreAdmissibleAndConsistent) {
  int isolated_beliefs = 0;
  for (std::uint64_t index = 0; index < 12; ++index) {
    const Problem problem = SlantedProblem(index, GetParam().costs, GetParam().insertable, 4);
    SCOPED_TRACE(problem.name);
    const MapOracle oracle(problem);
    HypothesisSets sets(problem, false);
    const StepCosts costs = MotionCosts(problem.cost, problem.move_lengths);
    std::array<Cell, 6> neighbours;
    for (const Direction d : kDirections) {
      neighbours[static_cast<std::size_t>(IndexOf(d))] = (SpreadOf(problem)[AxisOf(d)] + 1) * UnitCell(d);
    }
    IsolatedHypotheses isolated(sets, std::make_shared<PairCertificates>(problem.map, costs, SpreadOf(problem)),
                                neighbours);
    Problem generous = problem;  // takes the tables that tasks use
    generous.generous_workspace = true;
    std::vector<std::unique_ptr<const PlanningTables>> tables;
    std::vector<std::unique_ptr<BeliefHeuristic>> heuristics;
    for (const HeuristicKind kind : {HeuristicKind::kCertificate, HeuristicKind::kLines}) {
      SolverOptions options;
      options.heuristic = kind;
      tables.push_back(std::make_unique<const PlanningTables>(generous, options));
      heuristics.push_back(tables.back()->MakeHeuristic(generous, sets));
    }
    for (std::size_t which = 0; which < 3; ++which) {
      SCOPED_TRACE(which);
      std::vector<double> values;
      for (std::size_t b = 0; b < oracle.keys.size(); ++b) {
        const auto set = sets.Find(oracle.Members(b));
        ASSERT_TRUE(set.has_value());
        const Cell robot(oracle.keys[b].first[0], oracle.keys[b].first[1], 0);
        const double weighted = which == 0 ? oracle.goal[b] ? 0.0 : isolated.Weighted(*set, robot)
                                           : heuristics[which - 1]->Weighted(*set, robot);
        values.push_back(weighted / sets.info(*set).weight);
        ASSERT_LE(values[b], oracle.values[b] + 1e-9);
        if (which == 0 && values[b] > 0.0) ++isolated_beliefs;
      }
      for (std::size_t b = 0; b < values.size(); ++b) {
        for (const MapOracle::Action& action : oracle.actions[b]) {
          ASSERT_LE(values[b], MapOracle::Q(action, values) + 1e-9);
        }
      }
    }
  }
  EXPECT_GT(isolated_beliefs, 50);
}

INSTANTIATE_TEST_SUITE_P(Kinds, SlantedWalls,
                         ::testing::Values(Kind{false, false}, Kind{true, false}, Kind{false, true}, Kind{true, true}));

/// Until something is shown both fare the same, so the walk is common; the step that tells them apart at last is free
/// under one of them and blocked under the other. The tables may think of another such step for each, so the mean over
/// both is what the best policy costs, or half a cell less.
TEST(PairCertificates, AreExactButForTheLastStepWhereDistanceCosts) {
  int pairs = 0;
  int exact = 0;
  for (std::uint64_t index = 0; index < 40; ++index) {
    Problem problem = SlantedProblem(100 + index, false, false, 2);
    problem.workspace = {Cell(-12, -12, 0), Cell(12, 12, 0)};
    const MapOracle oracle(problem);
    if (!std::isfinite(oracle.values.front())) continue;
    const PairCertificates certificates(problem.map, {1.0, 0.0}, Cell::Zero());
    const Cell offset = problem.hypotheses[1].offset - problem.hypotheses[0].offset;
    const auto& first = certificates.Get(offset, 0);
    const auto& second = certificates.Get(-offset, 0);
    const double mean = 0.5 * first.grid.unit *
                        (first.At(problem.start - problem.hypotheses[0].offset) +
                         second.At(problem.start - problem.hypotheses[1].offset));
    EXPECT_LE(mean, oracle.values.front() + 1e-9);
    EXPECT_GE(mean, oracle.values.front() - 0.5 - 1e-9);
    exact += mean >= oracle.values.front() - 1e-9 ? 1 : 0;
    ++pairs;
  }
  EXPECT_GT(pairs, 20);
  EXPECT_GT(2 * exact, pairs);
}

TEST(PairCertificates, AreTheSameFromAnyThread) {
  RandomStream random(3, 0, "map");
  const auto map = SlantedMap(random);
  const PairCertificates shared(map, {1.0, 0.5}, Cell::Zero());
  std::vector<Cell> offsets;
  for (int x = -3; x <= 3; ++x) {
    for (int y = -3; y <= 3; ++y) {
      if (x != 0 || y != 0) offsets.emplace_back(x, y, 0);
    }
  }
  constexpr int kThreads = 4;
  std::vector<std::vector<const PairCertificates::Plane*>> seen(kThreads);
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t) {
      threads.emplace_back([&, t] {
        for (std::size_t i = 0; i < offsets.size(); ++i) {
          seen[static_cast<std::size_t>(t)].push_back(&shared.Get(offsets[t % 2 == 0 ? i : offsets.size() - 1 - i], 0));
        }
      });
    }
  }
  const PairCertificates alone(map, {1.0, 0.5}, Cell::Zero());
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    EXPECT_EQ(seen[0][i], seen[2][i]);
    EXPECT_EQ(seen[0][i], seen[1][offsets.size() - 1 - i]);
    EXPECT_EQ(seen[0][i]->values, alone.Get(offsets[i], 0).values);
  }
}

/// A box whose upright corners are cut by one cell leaves pairs that differ along a diagonal. Without a bound for them
/// searches wandered for ever.
TEST(CutCorners, RtdpBelConverges) {
  const Task task = testing::MakePlugTask();
  const auto map = testing::MakePlugMap(false, {10, 8, 6}, 3);
  SolverOptions options = FastSetting(SolverKind::kRtdpBel, 2.0);
  options.expansion_limit = 30000;
  const auto tables = BuildPlanningTables(MakeCuboidProblem(task, map, {2, 2, 2}), options);
  for (const Extents& extents : {Extents{2, 2, 2}, Extents{3, 3, 2}, Extents{4, 3, 5}, Extents{5, 5, 5}}) {
    SCOPED_TRACE(ToString(extents));
    const Problem problem = MakeCuboidProblem(task, map, extents);
    const SolverResult result = Solve(problem, options, tables);
    ASSERT_TRUE(result.complete()) << ToString(result.status);
    EXPECT_EQ(result.status, SolverStatus::kConverged);
    EXPECT_LT(result.expansions, 10000);
    EXPECT_EQ(Evaluate(problem, *result.policy).fault, "");
  }
}

}  // namespace
}  // namespace feeler::planner
