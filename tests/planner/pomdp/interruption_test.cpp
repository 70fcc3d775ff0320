// Work that takes long in one piece asks whether to stop within it, whatever the model is like:
// - reading, state bounds, classes, updates of the searches, controllers, each on a dense model;
// - bounds and values hold wherever they stopped;
// - elimination of states solves the chains that sweeps creep along, and can be stopped.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/model/controller.h"
#include "feeler/planner/pomdp/model/elimination.h"
#include "feeler/planner/pomdp/model/observable_classes.h"
#include "feeler/planner/pomdp/model/state_bounds.h"
#include "feeler/planner/pomdp/search/pomdp_belief_graph.h"
#include "feeler/planner/pomdp/search/solve_pomdp.h"

namespace feeler::planner {
namespace {

/// Every state leads to every state, and shows everything.
Pomdp Dense(std::size_t states, std::size_t actions, std::size_t observations, double discount) {
  Pomdp pomdp;
  pomdp.name = "dense";
  pomdp.discount = discount;
  for (std::size_t s = 0; s < states; ++s) pomdp.states.push_back("s" + std::to_string(s));
  for (std::size_t a = 0; a < actions; ++a) pomdp.actions.push_back("a" + std::to_string(a));
  for (std::size_t o = 0; o < observations; ++o) pomdp.observations.push_back("o" + std::to_string(o));
  const auto row = [](std::size_t count, std::size_t seed) {
    std::vector<SparseEntry> entries;
    double sum = 0.0;
    for (std::uint32_t i = 0; i < count; ++i) {
      entries.push_back({i, 1.0 + static_cast<double>((i * 7919 + seed * 104729) % 97)});
      sum += entries.back().value;
    }
    for (SparseEntry& entry : entries) entry.value /= sum;
    return entries;
  };
  for (std::size_t a = 0; a < actions; ++a) {
    for (std::size_t s = 0; s < states; ++s) {
      pomdp.transitions.Append(row(states, a * states + s));
      pomdp.observation_rows.Append(row(observations, 3 * a * states + s));
      pomdp.reward.push_back(static_cast<double>((a * 31 + s * 17) % 11) - 5.0);
    }
  }
  pomdp.start = row(states, 5);
  return pomdp;
}

TEST(Interruption, ReadingAsks) {
  const std::string text = FormatCassandraPomdp(Dense(60, 8, 4, 0.95));
  int asked = 0;
  EXPECT_THROW(ParseCassandraPomdp(text, "dense", [&] { return ++asked == 1; }), Interrupted);
  EXPECT_NO_THROW(ParseCassandraPomdp(text, "dense", [] { return false; }));
  EXPECT_THROW(ParsePomdpx(FormatPomdpx(Dense(60, 8, 4, 0.95)), "dense", [] { return true; }), Interrupted);
}

TEST(Interruption, BoundsHoldWhereverTheyStop) {
  const Pomdp pomdp = Dense(80, 6, 12, 0.9);
  const StateBounds settled = ComputeStateBounds(pomdp);
  for (const int most : {0, 1, 5, 40}) {
    int asked = 0;
    const StateBounds bounds = ComputeStateBounds(pomdp, {.stop = [&] { return ++asked > most; }});
    EXPECT_GT(asked, 0);
    for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
      for (std::size_t s = 0; s < pomdp.state_count(); ++s) {
        EXPECT_GE(bounds.qmdp[a][s], settled.qmdp[a][s] - 1e-6);
        EXPECT_GE(bounds.informed[a][s], settled.informed[a][s] - 1e-6);
        EXPECT_LE(bounds.blind[a][s], settled.blind[a][s] + 1e-6);
      }
    }
  }
}

TEST(Interruption, UpdatesAskWithinABelief) {
  const Pomdp pomdp = Dense(120, 4, 20, 0.95);
  EXPECT_FALSE(FindObservableClasses(pomdp, [] { return true; }));
  const StateBounds bounds = ComputeStateBounds(pomdp, {.sweeps = 2});
  PomdpBeliefGraph graph(pomdp, bounds, 0);
  graph.SetStop([] { return true; });
  EXPECT_THROW(graph.Actions(0), Interrupted);
  EXPECT_FALSE(graph.expanded(0));
  graph.SetStop({});
  EXPECT_EQ(graph.Actions(0).size(), 4U);
  const PomdpController one{{{0, {}, 0}}, 0};
  EXPECT_FALSE(EvaluateController(pomdp, one, [] { return true; }));
}

TEST(Interruption, CancelledSearchesKeepWhatTheyHave) {
  CancellationToken cancelled;
  cancelled.Cancel();
  const Pomdp pomdp = Dense(120, 4, 20, 0.9999);
  for (const PomdpSolverKind kind :
       {PomdpSolverKind::kPointBased, PomdpSolverKind::kCertified, PomdpSolverKind::kRtdpBel}) {
    PomdpSolverOptions options;
    options.kind = kind;
    options.cancellation = &cancelled;
    const PomdpResult result = SolvePomdp(pomdp, options);
    EXPECT_EQ(result.status, SolverStatus::kCancelled) << ToString(kind);
    EXPECT_LE(result.value_lower, result.value_upper);
    EXPECT_TRUE(result.controller);
  }
}

TEST(Elimination, SolvesChainsThatSweepsCreepAlong) {
  // A walk that goes up with a half and down with a half, reflected at the bottom: n - i before the top takes
  // n^2 - i^2 steps (and as much as it costs).
  constexpr std::uint32_t kCount = 400;
  SparseRows rows;
  std::vector<double> to_goal(kCount, 0.0);
  const std::vector<double> cost(kCount, 2.0);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    std::vector<SparseEntry> row;
    if (i == 0) {
      row.push_back({1, 1.0});
    } else {
      row.push_back({i - 1, 0.5});
      if (i + 1 < kCount) row.push_back({i + 1, 0.5});
    }
    if (i + 1 == kCount) to_goal[i] = 0.5;
    rows.Append(row);
  }
  Pulse never;
  const auto solved = EliminateStates(rows, to_goal, cost, never);
  ASSERT_TRUE(solved);
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const double steps = static_cast<double>(kCount) * kCount - static_cast<double>(i) * i;
    EXPECT_NEAR(solved->steps[i], steps, 1e-10 * steps);
    EXPECT_NEAR(solved->cost[i], 2.0 * steps, 1e-10 * steps);
  }
}

TEST(Elimination, CanBeStopped) {
  const Pomdp dense = Dense(500, 1, 1, 1.0);
  Pulse pulse([] { return true; });
  SparseRows rows;
  std::vector<SparseEntry> row;
  for (std::uint32_t s = 0; s < 500; ++s) {
    row.clear();
    for (const SparseEntry& next : dense.transitions.Row(s)) {
      if (next.index != s) row.push_back(next);
    }
    rows.Append(row);
  }
  const std::vector<double> ones(500, 1e-6);
  EXPECT_THROW(EliminateStates(rows, ones, ones, pulse), Interrupted);
}

}  // namespace
}  // namespace feeler::planner
