// Laws of an execution that doubts its readings:
// - weights follow Bayes' rule with the probabilities of outcomes of the noisy model; an outcome that no hypothesis
//   allows changes nothing; a contact that contradicts a hypothesis lowers it and does not drop it;
// - with false contacts the policy that was planned for them inserts where the one that takes every reading at its word
//   loses the tree, and what it believes is true;
// - where steps are spent or contacts missed it goes on, and inserts; what it believes is true;
// - what is there is believed: without false contacts nothing is lost.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <string>

#include "feeler/execution/executor.h"
#include "feeler/execution/lattice/outcome_matching.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/noise/solve_noisy.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/database_policy.h"
#include "feeler/policies/noisy_graph_policy.h"
#include "tests/execution/box_world.h"

namespace feeler::execution {
namespace {

TEST(Weigh, FollowsBayesAndLowersWhatAContactContradicts) {
  const auto map = HousingMap();
  const planner::Problem problem = planner::MakeCuboidProblem(HousingTask(), map, {1, 1, 5});
  std::vector<TrackedHypothesis> tracked;
  for (const auto& h : problem.hypotheses) tracked.push_back({h, Eigen::Vector3d::Zero()});
  const Cell robot(0, 0, 12);
  const GuardedMove move{Direction::kMinusZ, 11};  // walls after 8 .. 12 cells: hypotheses 4 .. 0
  const Touch touch{robot.cast<double>() + map->phase(), Direction::kMinusZ, 10.5, true};  // that of hypothesis 2
  const planner::Noise noise{0.1, 0.05, 0.0};
  planner::NoisyMoves moves(noise);
  ASSERT_EQ(map->Predict(robot - problem.hypotheses[2].offset, move, 0), (Outcome{10, true}));
  ASSERT_TRUE(Weigh(*map, robot, move, touch, {10, true}, {}, moves, tracked));
  // Walls before the tenth cell are out: the tool does not pass them. Those behind it stay, with a false contact.
  ASSERT_EQ(tracked.size(), 3u);
  const double free = std::pow(0.95, 10);
  const double wall = free * 0.9;
  const double no_wall = free * 0.05;
  const double sum = wall + 2.0 * no_wall;
  EXPECT_NEAR(tracked[2].hypothesis.weight, wall / sum, 1e-12);
  EXPECT_NEAR(tracked[0].hypothesis.weight, no_wall / sum, 1e-12);
  EXPECT_NEAR(tracked[1].hypothesis.weight, no_wall / sum, 1e-12);
  EXPECT_EQ(Likeliest(tracked), 2u);
  EXPECT_LT(Mismatch(*map, tracked[2], touch), 1e-4) << "it is shifted to explain the reading";
  EXPECT_EQ(tracked[0].anchor, Eigen::Vector3d(Eigen::Vector3d::Zero())) << "what does not explain it is not";

  const std::vector<TrackedHypothesis> before = tracked;
  planner::NoisyMoves sure(planner::Noise{0.1, 0.0, 0.0});
  EXPECT_FALSE(Weigh(*map, robot, move, touch, {3, true}, {}, sure, tracked));
  ASSERT_EQ(tracked.size(), before.size());
  EXPECT_EQ(tracked[1].hypothesis.weight, before[1].hypothesis.weight);

  KeepLikely(0.85, tracked);
  ASSERT_EQ(tracked.size(), 1u);
  EXPECT_EQ(tracked[0].hypothesis.offset, problem.hypotheses[2].offset);
}

TEST(Weigh, ReadsOutcomesAtTheirWord) {
  const GuardedMove move{Direction::kPlusX, 4};
  EXPECT_EQ(OutcomeAsRead(move, 2.4, true), (Outcome{2, true}));
  EXPECT_EQ(OutcomeAsRead(move, 2.95, true), (Outcome{3, true}));
  EXPECT_EQ(OutcomeAsRead(move, -0.2, true), (Outcome{0, true}));
  EXPECT_EQ(OutcomeAsRead(move, 4.2, true), (Outcome{4, false})) << "behind the end of the move";
}

struct Counts {
  int inserted = 0;
  int wrong = 0;                       ///< believed in an insertion that was none
  std::map<std::string, int> reasons;  ///< of those not inserted
};

std::string Text(const Counts& counts) {
  std::string text;
  for (const auto& [reason, count] : counts.reasons) text += std::to_string(count) + " " + reason + "\n";
  return text;
}

Counts RunAll(const planner::Problem& problem, policies::Policy& policy, const RobotFaults& faults, int episodes) {
  const Task task = HousingTask();
  Counts counts;
  for (int i = 0; i < episodes; ++i) {
    const auto number = static_cast<std::uint64_t>(i);
    RandomStream draw(4, number, "true pose");
    Pose truth = Pose::Identity();
    for (int axis = 0; axis < 3; ++axis) truth.translation()[axis] = draw.Uniform(-1.5, 1.5) * task.cell_m;
    KinematicRobot robot(HousingOverPanel(), task, truth, LatticeStartPose(task, problem, Pose::Identity()), faults,
                         RandomStream(4, number, "robot"));
    const ExecutionRecord record = Execute(task, problem, Pose::Identity(), policy, robot);
    counts.inserted += robot.Inserted();
    if (!robot.Inserted()) ++counts.reasons[record.reason];
    counts.wrong += record.believed_inserted && !robot.Inserted();
  }
  return counts;
}

/// The policy that is planned for the noise, and one that knows of none.
struct Planned {
  explicit Planned(const planner::Noise& noise)
      : problem(planner::MakeCuboidProblem(HousingTask(), HousingMap(), {3, 3, 3})) {
    planner::SolverOptions options;
    options.expansion_limit = 2000;  // a first policy needs several hundred
    planner::NoisyResult doubting = planner::SolveNoisy({problem, noise, {}}, options);
    noisy = std::make_unique<policies::NoisyGraphPolicy>(
        std::make_shared<const planner::NoisyPolicy>(std::move(doubting.policy)),
        policies::Doubt{noise, planner::Declaration{}.confidence});
    plain = std::make_unique<policies::DatabasePolicy>(
        std::make_shared<const planner::PolicyGraph>(*planner::Solve(problem, options).policy));
  }
  planner::Problem problem;
  std::unique_ptr<policies::NoisyGraphPolicy> noisy;
  std::unique_ptr<policies::DatabasePolicy> plain;
};

/// In a world with the noise that it is planned for a policy inserts, one that knows of none far less often; without
/// noise it inserts, too.
void ExpectNoiseIsWorthKnowing(const planner::Noise& noise, const RobotFaults& faults) {
  constexpr int kEpisodes = 40;
  Planned planned(noise);
  const Counts with = RunAll(planned.problem, *planned.noisy, faults, kEpisodes);
  const Counts without = RunAll(planned.problem, *planned.plain, faults, kEpisodes);
  EXPECT_GE(with.inserted, 36) << Text(with);
  EXPECT_LE(without.inserted, with.inserted - 10) << Text(without);
  EXPECT_EQ(with.wrong, 0);
  EXPECT_EQ(RunAll(planned.problem, *planned.noisy, {}, 10).inserted, 10);
}

TEST(Doubt, InsertsWhereReadingsAtTheirWordLoseTheTree) {
  const planner::Noise noise{0.0, 0.02, 0.0};
  RobotFaults faults;
  faults.false_stops_per_m = -std::log1p(-noise.false_stop) / HousingTask().cell_m;
  ExpectNoiseIsWorthKnowing(noise, faults);
}

TEST(Doubt, GoesOnWhereAStepWasSpent) {
  const planner::Noise noise{0.0, 0.0, 0.05};
  RobotFaults faults;
  faults.step_m = HousingTask().cell_m;
  faults.spent_step = noise.slip;
  ExpectNoiseIsWorthKnowing(noise, faults);
}

TEST(Doubt, FeelsForAContactThatWasMissed) {
  const planner::Noise noise{0.1, 0.0, 0.0};
  Planned planned(noise);
  RobotFaults faults;
  faults.step_m = HousingTask().cell_m;
  faults.missed_contact = noise.missed_contact;
  const Counts with = RunAll(planned.problem, *planned.noisy, faults, 40);
  EXPECT_GE(with.inserted, 36) << Text(with);
  EXPECT_EQ(with.wrong, 0);
  EXPECT_EQ(RunAll(planned.problem, *planned.noisy, {}, 10).inserted, 10);
}

}  // namespace
}  // namespace feeler::execution
