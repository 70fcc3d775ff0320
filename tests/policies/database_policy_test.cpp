// Laws of the walk through a stored policy graph:
// - under every hypothesis of a lattice world the walk ends at a leaf that names exactly that hypothesis, in the
//   coordinates of the problem, though nodes are shared between translates;
// - an outcome without a branch is refused and changes nothing; Begin erases the past;
// - a graph whose indices lead nowhere is refused; a cyclic one ends in giving up, not in a loop.
#include "feeler/policies/database_policy.h"

#include <gtest/gtest.h>

#include <memory>
#include <variant>

#include "feeler/core/error.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/solve.h"
#include "tests/policies/block_problem.h"

namespace feeler::policies {
namespace {

std::shared_ptr<const planner::PolicyGraph> Solved(const planner::Problem& problem) {
  const planner::SolverResult result =
      planner::Solve(problem, planner::FastSetting(planner::SolverKind::kCertified, 1.5));
  if (!result.policy) return nullptr;
  return std::make_shared<const planner::PolicyGraph>(*result.policy);
}

TEST(DatabasePolicy, EndsAtTheLeafOfTheTrueHypothesis) {
  const planner::Problem problem = SmallBlockProblem({3, 3, 3});
  const auto graph = Solved(problem);
  ASSERT_TRUE(graph);
  DatabasePolicy policy(graph);
  EXPECT_EQ(policy.name(), "database");
  for (const Hypothesis& truth : problem.hypotheses) {
    policy.Begin(problem);
    Belief belief{problem.start, problem.hypotheses};
    int moves = 0;
    for (; moves < 200; ++moves) {
      const Decision decision = policy.Next(belief);
      if (!std::holds_alternative<GuardedMove>(decision)) break;
      const GuardedMove move = std::get<GuardedMove>(decision);
      EXPECT_EQ(std::get<GuardedMove>(policy.Next(belief)), move);  // repeatable
      const Outcome outcome = planner::Simulate(problem, belief.robot, move, truth);
      std::erase_if(belief.hypotheses, [&](const Hypothesis& h) {
        return !(planner::Simulate(problem, belief.robot, move, h) == outcome);
      });
      belief.robot += outcome.cells * UnitCell(move.direction);
      ASSERT_TRUE(policy.Observe(outcome));
    }
    EXPECT_TRUE(std::holds_alternative<Insert>(policy.Next(belief)));
    ASSERT_EQ(belief.hypotheses.size(), 1U);
    ASSERT_EQ(policy.LeafHypotheses().size(), 1U);
    EXPECT_EQ(policy.LeafHypotheses().front().offset, truth.offset);
    EXPECT_EQ(belief.hypotheses.front().offset, truth.offset);
  }
}

TEST(DatabasePolicy, UnknownOutcomeIsRefusedAndChangesNothing) {
  const planner::Problem problem = SmallBlockProblem({3, 3, 3});
  const auto graph = Solved(problem);
  ASSERT_TRUE(graph);
  DatabasePolicy policy(graph);
  policy.Begin(problem);
  const planner::PolicyNode* root = &policy.node();
  EXPECT_FALSE(policy.Observe({12345, true}));
  EXPECT_EQ(&policy.node(), root);
  ASSERT_FALSE(root->branches.empty());
  EXPECT_TRUE(policy.Observe(root->branches.front().outcome));
  policy.Begin(problem);
  EXPECT_EQ(&policy.node(), root);
  EXPECT_EQ(policy.shift(), Cell::Zero());
}

TEST(DatabasePolicy, BadGraphsAreRefused) {
  EXPECT_THROW(DatabasePolicy(nullptr), InputError);
  planner::PolicyGraph empty;
  EXPECT_THROW(DatabasePolicy(std::make_shared<const planner::PolicyGraph>(empty)), InputError);
  planner::PolicyGraph dangling;
  dangling.nodes.resize(1);
  dangling.nodes[0].branches.push_back({{1, true}, 7, Cell::Zero(), 1.0});
  EXPECT_THROW(DatabasePolicy(std::make_shared<const planner::PolicyGraph>(dangling)), InputError);
}

TEST(DatabasePolicy, ACycleEndsInGivingUp) {
  planner::PolicyGraph cycle;
  cycle.nodes.resize(1);
  cycle.nodes[0].move = {Direction::kPlusX, 1};
  cycle.nodes[0].branches.push_back({{1, false}, 0, Cell::Zero(), 1.0});
  DatabasePolicy policy(std::make_shared<const planner::PolicyGraph>(cycle));
  policy.Begin(planner::Problem{});
  ASSERT_TRUE(policy.Observe({1, false}));
  EXPECT_TRUE(std::holds_alternative<GiveUp>(policy.Next({})));
}

}  // namespace
}  // namespace feeler::policies
