// Laws of the policies that are no graph from a database:
// - online: localizes every truth at any budget; with a generous one its cost is within the gap of the optimum; with a
//   budget of expansions the same walk comes out every time;
// - spiral: its search covers the box where the target may be, whatever the uncertainty; it refuses what it cannot do;
// - hybrid: chooses once, by the half width across the insertion, and then is the policy chosen.
#include <gtest/gtest.h>

#include <memory>

#include "feeler/core/error.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/online_policy.h"
#include "feeler/policies/open_loop.h"
#include "feeler/policies/spiral/hybrid_policy.h"
#include "feeler/policies/spiral/spiral_policy.h"
#include "feeler/policies/touch/kinematic_walk.h"
#include "tests/policies/block_problem.h"

namespace feeler::policies {
namespace {

double MeanCost(const planner::Problem& problem, const OnlineOptions& options) {
  const auto tables = std::make_shared<planner::PlanningTablesCache>();
  OnlinePolicy policy(options, tables);
  double sum = 0.0;
  for (const planner::Hypothesis& truth : problem.hypotheses) {
    const KinematicWalk walk = Walk(problem, policy, truth);
    EXPECT_TRUE(walk.localized) << walk.reason;
    sum += walk.cost;
  }
  return sum / static_cast<double>(problem.hypotheses.size());
}

TEST(OnlinePolicyTest, LocalizesEveryTruthWithinItsGap) {
  const planner::Problem problem = SmallBlockProblem({3, 3, 2});
  const planner::SolverResult optimum =
      planner::Solve(problem, planner::FastSetting(planner::SolverKind::kCertified, 1.0));
  OnlineOptions generous;
  generous.expansion_limit = 200000;
  EXPECT_LE(MeanCost(problem, generous), generous.gap * optimum.expected_cost + 1e-9);
  OnlineOptions poor;
  poor.expansion_limit = 1;
  const double cost = MeanCost(problem, poor);
  EXPECT_GE(cost, optimum.lower_bound - 1e-9);
  EXPECT_EQ(cost, MeanCost(problem, poor));
}

TEST(OnlinePolicyTest, RefusesBudgetsThatAreNone) {
  const auto tables = std::make_shared<planner::PlanningTablesCache>();
  OnlineOptions no_time, no_expansions, no_gap;
  no_time.time_limit_s = 0.0;
  no_expansions.expansion_limit = 0;
  no_gap.gap = 0.5;
  for (const OnlineOptions& options : {no_time, no_expansions, no_gap}) {
    EXPECT_THROW(OnlinePolicy(options, tables), InputError);
  }
}

TEST(SpiralPolicyTest, CoversTheBoxOfPossiblePositions) {
  const double cell_m = 0.002;
  for (const planner::Extents extents : {planner::Extents{2, 2, 2}, planner::Extents{5, 3, 4}}) {
    const planner::Problem problem = SmallBlockProblem(extents);
    SpiralPolicy policy(Direction::kMinusZ, cell_m, {});
    policy.Begin(problem);
    const auto search = std::get<SpiralSearch>(policy.Next({problem.start, problem.hypotheses}));
    const Eigen::Vector3d half = 0.5 * cell_m * Eigen::Vector3d(extents.nx, extents.ny, extents.nz);
    EXPECT_GE(search.radius_m, half.head<2>().norm());
    EXPECT_LE(search.radius_m, half.head<2>().norm() + 2 * search.pitch_m + 0.0005 * search.press_n);
    EXPECT_GE(search.face_range_m, half.z());
  }
  EXPECT_THROW(SpiralPolicy(Direction::kMinusZ, cell_m, {0.0, 0.02, 10.0}), InputError);
  EXPECT_THROW(SpiralPolicy(Direction::kMinusZ, cell_m, {0.001, -1.0, 10.0}), InputError);
  planner::Problem turned = SmallBlockProblem({2, 2, 2});
  turned.hypotheses[1].orientation = 1;
  SpiralPolicy policy(Direction::kMinusZ, cell_m, {});
  EXPECT_THROW(policy.Begin(turned), InputError);
}

TEST(HybridPolicyTest, ChoosesByTheHalfWidthAcrossTheInsertion) {
  const double cell_m = 0.002;
  const auto chosen = [&](const planner::Extents& extents, double threshold_m) {
    HybridPolicy policy(std::make_unique<SpiralPolicy>(Direction::kMinusZ, cell_m, SpiralTuning{}),
                        std::make_unique<OpenLoopPolicy>(), Direction::kMinusZ, cell_m, threshold_m);
    const planner::Problem problem = SmallBlockProblem(extents);
    policy.Begin(problem);
    const bool spirals = std::holds_alternative<SpiralSearch>(policy.Next({problem.start, problem.hypotheses}));
    EXPECT_EQ(spirals, policy.chosen() == "spiral");
    return std::string(policy.chosen());
  };
  EXPECT_EQ(chosen({3, 3, 5}, 0.0031), "spiral") << "the height does not count";
  EXPECT_EQ(chosen({3, 3, 5}, 0.003), "open-loop");
  EXPECT_EQ(chosen({2, 4, 2}, 0.0031), "open-loop");
  EXPECT_EQ(chosen({2, 2, 2}, 0.0), "open-loop");
}

}  // namespace
}  // namespace feeler::policies
