// Laws of the solvers of general POMDPs:
// - L <= V* <= U against an oracle that looks ahead through every history with the tables alone, and L and U meet as
//   far as asked; the point-based and the certified solver agree;
// - the controller that comes out is worth what is said, by the linear system and by simulation; evaluation agrees with
//   a dense solve of the same system;
// - bounds of states: blind <= V* <= informed <= QMDP;
// - RTDP-Bel without discretisation solves what is small; with it its controller is worth no more than U;
// - trials over the beliefs themselves know of evidence that is too weak for the levels of the discretisation, with and
//   without discount;
// - E-RTDP-Bel without experience is RTDP-Bel, and with a policy of the problem itself no worse;
// - goal POMDPs cost what they must, whether the goal shows or not; those without a way to a goal are refused, and
//   where none is for certain nothing is made up; same seed, same result.
#include "feeler/planner/pomdp/search/solve_pomdp.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "feeler/core/error.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/noise/noisy_pomdp.h"
#include "feeler/planner/pomdp/files/alpha_file.h"
#include "feeler/planner/pomdp/model/rock_sample.h"
#include "feeler/planner/pomdp/model/simulate.h"
#include "feeler/planner/pomdp/model/state_bounds.h"
#include "tests/planner/pomdp/small_models.h"

namespace feeler::planner {
namespace {

PomdpResult Solve(const Pomdp& pomdp, PomdpSolverKind kind, double precision = 1e-3) {
  PomdpSolverOptions options;
  options.kind = kind;
  options.precision = precision;
  options.time_limit_s = 20.0;
  return SolvePomdp(pomdp, options);
}

/// The controller's linear system over all pairs of node and state, solved densely where it is small.
double DenseValue(const Pomdp& pomdp, const PomdpController& controller) {
  const std::size_t count = pomdp.state_count();
  if (controller.nodes.size() * count > 1000) return EvaluateController(pomdp, controller)->value;
  const auto size = static_cast<Eigen::Index>(controller.nodes.size() * count);
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(size, size);
  Eigen::VectorXd r = Eigen::VectorXd::Zero(size);
  const std::vector<std::uint8_t> goals = AbsorbingStates(pomdp);
  for (std::size_t n = 0; n < controller.nodes.size(); ++n) {
    for (std::size_t s = 0; s < count; ++s) {
      if (goals[s] != 0) continue;
      const auto row = static_cast<Eigen::Index>(n * count + s);
      const std::size_t at = pomdp.At(controller.nodes[n].action, s);
      r[row] = pomdp.reward[at];
      for (const SparseEntry& next : pomdp.transitions.Row(at)) {
        for (const SparseEntry& o : pomdp.observation_rows.Row(pomdp.At(controller.nodes[n].action, next.index))) {
          const std::size_t to = controller.Next(static_cast<std::uint32_t>(n), o.index) * count + next.index;
          a(row, static_cast<Eigen::Index>(to)) -= pomdp.discount * next.value * o.value;
        }
      }
    }
  }
  const Eigen::VectorXd v = a.partialPivLu().solve(r);
  double value = 0.0;
  for (const SparseEntry& s : pomdp.start)
    value += s.value * v[static_cast<Eigen::Index>(controller.root * count + s.index)];
  return value;
}

class RandomModels : public testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomModels, BoundsHoldAndMeet) {
  const int states = 2 + static_cast<int>(GetParam() % 3);
  const Pomdp pomdp = ParseCassandraPomdp(RandomModelText(GetParam(), states, 2, 2, 0.5), "random");
  const Interval truth = LookAheadOracle(pomdp, 9);
  const StateBounds bounds = ComputeStateBounds(pomdp);
  EXPECT_LE(BestRow(bounds.blind, pomdp.start), truth.high);
  EXPECT_GE(BestRow(bounds.informed, pomdp.start), truth.low);
  EXPECT_LE(BestRow(bounds.informed, pomdp.start), BestRow(bounds.qmdp, pomdp.start) + 1e-12);
  for (const PomdpSolverKind kind : {PomdpSolverKind::kPointBased, PomdpSolverKind::kCertified}) {
    // A tree of exact beliefs closes later.
    const double precision = kind == PomdpSolverKind::kPointBased ? 1e-3 : 0.02;
    const PomdpResult result = Solve(pomdp, kind, precision);
    EXPECT_EQ(result.status, SolverStatus::kConverged);
    EXPECT_LE(result.value_upper - result.value_lower, precision + 1e-12);
    EXPECT_LE(result.value_lower, truth.high + 1e-9) << ToString(kind);
    EXPECT_GE(result.value_upper, truth.low - 1e-9) << ToString(kind);
    ASSERT_TRUE(result.controller);
    const double value = DenseValue(pomdp, *result.controller);
    EXPECT_GE(value, result.value_lower - 1e-9) << ToString(kind);
    EXPECT_LE(value, result.value_upper + 1e-9) << ToString(kind);
    EXPECT_NEAR(EvaluateController(pomdp, *result.controller)->value, value, 1e-9);
  }
  // Without discretisation RTDP-Bel proves what it solves; with it the policy is worth at most V*.
  for (const int levels : {0, 10}) {
    PomdpSolverOptions options;
    options.kind = PomdpSolverKind::kRtdpBel;
    options.levels = levels;
    options.expansion_limit = 300;
    const PomdpResult result = SolvePomdp(pomdp, options);
    EXPECT_LE(result.value_lower, truth.high + 1e-9);
    EXPECT_GE(result.value_upper, truth.low - 1e-9);
    if (result.controller) {
      EXPECT_LE(DenseValue(pomdp, *result.controller), truth.high + 1e-9);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomModels, testing::Range<std::uint64_t>(1, 13));

TEST(SolvePomdp, TigerIsCyclicAndWorthWhatThePapersSay) {
  const Pomdp tiger = ParseCassandraPomdp(kTiger, "tiger");
  for (const PomdpSolverKind kind :
       {PomdpSolverKind::kPointBased, PomdpSolverKind::kCertified, PomdpSolverKind::kRtdpBel}) {
    const PomdpResult result = Solve(tiger, kind);
    EXPECT_NEAR(result.value_lower, 19.3713, 2e-3) << ToString(kind);
    ASSERT_TRUE(result.controller);
    EXPECT_LE(result.controller->nodes.size(), 20U);
    EXPECT_NEAR(DenseValue(tiger, *result.controller), result.value_lower, 2e-3);
  }
}

TEST(SolvePomdp, SimulationAgreesWithTheValue) {
  const Pomdp pomdp = MakeRockSample(DrawRockSample(3, 3, 4));
  const PomdpResult result = Solve(pomdp, PomdpSolverKind::kPointBased);
  ASSERT_TRUE(result.controller);
  ControllerAgent agent(*result.controller);
  SimulationOptions options;
  options.episodes = 4000;
  const SimulationResult simulated = SimulatePomdp(pomdp, agent, options);
  EXPECT_NEAR(simulated.mean, result.value_lower, 2.0 * simulated.half_width);
  EXPECT_EQ(simulated.at_goal, 4000);
  // The alpha vectors say the same, also written out and read back.
  const auto alphas = ParseAlpha(FormatAlpha(pomdp, result.alphas), "alpha", pomdp);
  const auto policyx = ParsePolicyx(FormatPolicyx(pomdp, result.alphas), "policyx", pomdp);
  ASSERT_EQ(alphas.size(), result.alphas.size());
  ASSERT_EQ(policyx.size(), result.alphas.size());
  BeliefAgent by_vectors(pomdp, [&](std::span<const SparseEntry> belief) { return BestAction(policyx, belief); });
  const SimulationResult again = SimulatePomdp(pomdp, by_vectors, options);
  EXPECT_GE(again.mean, result.value_lower - 2.0 * again.half_width);
  double best = -1e9;
  for (const FullAlphaVector& alpha : alphas) {
    double value = 0.0;
    for (const SparseEntry& s : pomdp.start) value += s.value * alpha.values[s.index].value;
    best = std::max(best, value);
  }
  EXPECT_LE(best, result.value_upper + 1e-9);
  EXPECT_GE(best, result.value_lower - 1e-3);
}

TEST(SolvePomdp, RockSampleIsTheDescriptionsModel) {
  RockSample problem;
  problem.size = 2;
  problem.rocks = {{1, 0}};
  problem.start = {0, 0};
  const Pomdp p = MakeRockSample(problem);
  EXPECT_EQ(p.state_count(), 9U);
  EXPECT_EQ(p.action_count(), 6U);
  // East to the rock, check it where the sensor is certain, sample if good, east: against leaving at once.
  const double g = 0.95;
  const double sampled = g * g * 0.5 * (10.0 + g * 10.0) + g * g * 0.5 * 10.0;
  const double blind = g * 0.0 + g * g * 10.0;  // sampling unseen earns nothing on average, and delays
  const PomdpResult result = Solve(p, PomdpSolverKind::kPointBased, 1e-6);
  EXPECT_NEAR(result.value_lower, std::max({sampled, g * 10.0, blind}), 1e-5);
}

TEST(SolvePomdp, GoalProblems) {
  // One of two doors is right; asking costs 1 and is right in 80 %; a wrong door costs 20 and ends it, too.
  const std::string text =
      "discount: 1.0\nvalues: cost\nstates: left right done\nactions: ask go-left go-right\nobservations: l r\nstart: "
      "0.5 0.5 0.0\n"
      "T: ask identity\nT: go-left : * : done 1.0\nT: go-right : * : done 1.0\n"
      "O: * uniform\nO: ask : left\n0.8 0.2\nO: ask : right\n0.2 0.8\n"
      "R: ask : left : * : * 1\nR: ask : right : * : * 1\nR: go-left : right : * : * 20\nR: go-right : left : * : * "
      "20\n";
  const Pomdp pomdp = ParseCassandraPomdp(text, "doors");
  // The belief is a walk on the difference d of answers, the odds 4^d: stop at |d| = n, the best n by the ruin formula.
  double least = 10.0;
  for (int n = 1; n < 10; ++n) {
    const double wrong = 1.0 / (1.0 + std::pow(4.0, n));
    const double steps = n / 0.6 * (1.0 - 2.0 * wrong);
    least = std::min(least, steps + 20.0 * wrong);
  }
  const PomdpResult result = Solve(pomdp, PomdpSolverKind::kCertified, 1e-4);
  EXPECT_NEAR(result.value_lower, -least, 1e-3);
  EXPECT_LE(result.value_lower, -least + 1e-9);
  EXPECT_GE(result.value_upper, -least - 1e-9);
  ASSERT_TRUE(result.controller);
  EXPECT_NEAR(EvaluateController(pomdp, *result.controller)->value, -least, 1e-3);
  EXPECT_THROW(Solve(pomdp, PomdpSolverKind::kPointBased), InputError);
}

/// One action of cost 1 that reaches the goal with probability p; `sensor` are the rows of s and g over o and p.
Pomdp Knocking(double p, const std::string& sensor) {
  const std::string chance = std::to_string(p);
  return ParseCassandraPomdp(
      "discount: 1\nvalues: cost\nstates: s g\nactions: a\nobservations: o p\nstart: s\nT: a : s : g " + chance +
          "\nT: a : s : s " + std::to_string(1.0 - p) + "\nT: a : g : g 1\nO: a\n" + sensor + "\nR: a : s : * : * 1\n",
      "knocking");
}

TEST(SolvePomdp, GoalsNeedNotShow) {
  for (const std::string sensor : {"1 0 1 0", "0.9 0.1 0.1 0.9", "1 0 0 1"}) {
    for (const double p : {0.5, 0.005}) {
      for (const PomdpSolverKind kind : {PomdpSolverKind::kCertified, PomdpSolverKind::kRtdpBel}) {
        const PomdpResult result = Solve(Knocking(p, sensor), kind);
        EXPECT_EQ(result.status, SolverStatus::kConverged);
        EXPECT_NEAR(result.value_lower, -1.0 / p, 1e-6 / p) << sensor << p << ToString(kind);
        EXPECT_GE(result.value_upper, -1.0 / p - 1e-9) << sensor << p << ToString(kind);
        ASSERT_TRUE(result.controller);
      }
    }
  }
  // Half of the initial belief is at the goal already.
  Pomdp half = Knocking(0.5, "1 0 1 0");
  half.start = {{0, 0.5}, {1, 0.5}};
  EXPECT_NEAR(Solve(half, PomdpSolverKind::kCertified).value_lower, -1.0, 1e-9);
  EXPECT_NEAR(Solve(half, PomdpSolverKind::kCertified).value_upper, -1.0, 1e-6);
}

TEST(SolvePomdp, ControllersThatTakeLongAreEvaluatedFromBelow) {
  PomdpController once{{{0, {}, 0}}, 0};
  Pomdp slow = Knocking(0.5, "1 0 0 1");
  slow.transitions.entries[0].value = 1.0 - 1e-5;
  slow.transitions.entries[1].value = 1e-5;
  const auto value = EvaluateController(slow, once);
  ASSERT_TRUE(value);
  EXPECT_NEAR(value->value, -1e5, 1e-4);
  // To and fro, which sweeps would follow for long.
  const Pomdp round = ParseCassandraPomdp(
      "discount: 1\nvalues: cost\nstates: s t g\nactions: a\nobservations: o\nstart: s\nT: a : s : t 1\n"
      "T: a : t : s 0.99999\nT: a : t : g 0.00001\nT: a : g : g 1\nO: a uniform\nR: a : s : * : * 1\n"
      "R: a : t : * : * 1\n",
      "round");
  const auto both = EvaluateController(round, once);
  ASSERT_TRUE(both);
  EXPECT_NEAR(both->value, -2e5, 1e-3);
  for (const PomdpSolverKind kind : {PomdpSolverKind::kCertified, PomdpSolverKind::kRtdpBel}) {
    PomdpSolverOptions options;
    options.kind = kind;
    options.levels = 0;  // a trial takes 1e5 steps
    options.time_limit_s = 20.0;
    const PomdpResult result = SolvePomdp(slow, options);
    EXPECT_NEAR(result.value_lower, -1e5, 1e-3);
    EXPECT_GE(result.value_upper, -1e5 - 1e-3);
  }
}

TEST(SolvePomdp, PoliciesThatComeBackReachTheGoal) {
  // Two states that readings tell apart a little; either action ends with probability 0.5, at the lower cost in its own
  // state. Beliefs go on without end, the goal shows.
  const std::string text =
      "discount: 1\nvalues: cost\nstates: s t g\nactions: a b\nobservations: o p done\nstart: 0.5 0.5 0\n"
      "T: * : g : g 1\nT: * : s : g 0.5\nT: * : s : s 0.5\nT: * : t : g 0.5\nT: * : t : t 0.5\n"
      "O: * : s 0.6 0.4 0\nO: * : t 0.4 0.6 0\nO: * : g 0 0 1\n"
      "R: a : s : * : * 1\nR: b : s : * : * 3\nR: a : t : * : * 3\nR: b : t : * : * 1\n";
  const Pomdp readings = ParseCassandraPomdp(text, "readings");
  const PomdpResult first = Solve(readings, PomdpSolverKind::kCertified);
  EXPECT_EQ(first.status, SolverStatus::kConverged);
  EXPECT_LE(first.value_upper - first.value_lower, 1e-3 + 1e-12);
  EXPECT_NEAR(first.value_lower, -3.7706, 1e-3);
  ASSERT_TRUE(first.controller);
  EXPECT_GE(DenseValue(readings, *first.controller), first.value_lower - 1e-9);
  // No action alone reaches the goal, a policy that comes back to where it was does: two steps, half of the time.
  const Pomdp turns = ParseCassandraPomdp(
      "discount: 1\nvalues: cost\nstates: s t g\nactions: a b\nobservations: o\nstart: s\n"
      "T: a : s : t 1\nT: a : t : t 1\nT: b : s : s 1\nT: b : t : g 0.5\nT: b : t : s 0.5\nT: * : g : g 1\n"
      "O: * uniform\nR: * : s : * : * 1\nR: * : t : * : * 1\n",
      "turns");
  const PomdpResult second = Solve(turns, PomdpSolverKind::kCertified);
  EXPECT_EQ(second.status, SolverStatus::kConverged);
  EXPECT_NEAR(second.value_lower, -4.0, 1e-9);
  EXPECT_NEAR(second.value_upper, -4.0, 1e-3);
  ASSERT_TRUE(second.controller);
  EXPECT_NEAR(DenseValue(turns, *second.controller), -4.0, 1e-9);
}

TEST(SolvePomdp, TheLowerValueIsThatOfTheController) {
  const Pomdp pomdp = MakeRockSample(DrawRockSample(3, 2, 2));
  for (const PomdpSolverKind kind :
       {PomdpSolverKind::kPointBased, PomdpSolverKind::kCertified, PomdpSolverKind::kRtdpBel}) {
    for (const int expansions : {1, 20, 2000}) {
      PomdpSolverOptions options;
      options.kind = kind;
      options.expansion_limit = expansions;
      const PomdpResult result = SolvePomdp(pomdp, options);
      ASSERT_TRUE(result.controller);
      EXPECT_GE(EvaluateController(pomdp, *result.controller)->value, result.value_lower - 1e-9) << ToString(kind);
    }
  }
  // Cut after its first sweep, a value is below what it is worth all the same.
  const PomdpResult best = Solve(pomdp, PomdpSolverKind::kPointBased);
  const auto cut = EvaluateController(pomdp, *best.controller, [] { return true; });
  ASSERT_TRUE(cut);
  EXPECT_LE(cut->value, best.value_lower + 1e-9);
  EXPECT_GE(cut->value, -1e3);
  // Rewards alone: each sweep is below the value as it is.
  Pomdp gains = pomdp;
  for (double& reward : gains.reward) reward = std::max(0.0, reward);
  EXPECT_GE(EvaluateController(gains, *best.controller, [] { return true; })->value, 0.0);
}

TEST(SolvePomdp, DeadEndsOfBeliefs) {
  // Each door is right for one state, and nothing tells the states apart.
  const Pomdp pomdp = ParseCassandraPomdp(
      "discount: 1\nvalues: cost\nstates: s t trap g\nactions: a b\nobservations: o\nstart: 0.5 0.5 0 0\n"
      "T: a : s : g 1\nT: a : t : trap 1\nT: b : s : trap 1\nT: b : t : g 1\nT: * : trap : trap 1\nT: * : g : g 1\n"
      "O: * uniform\nR: * : s : * : * 1\nR: * : t : * : * 1\nR: * : trap : * : * 1\n",
      "doors");
  for (const int levels : {0, 15}) {
    PomdpSolverOptions options;
    options.kind = PomdpSolverKind::kRtdpBel;
    options.levels = levels;
    options.time_limit_s = 5.0;
    const PomdpResult result = SolvePomdp(pomdp, options);
    EXPECT_EQ(result.status, SolverStatus::kConverged);
    EXPECT_FALSE(result.controller);
  }
}

TEST(SolvePomdp, NoWayToAGoalIsSaid) {
  const std::string text =
      "discount: 1.0\nvalues: cost\nstates: here trap done\nactions: go\nobservations: o\nstart: here\n"
      "T: go : here : trap 0.5\nT: go : here : done 0.5\nT: go : trap : trap 1.0\nT: go : done : done 1.0\nO: * "
      "uniform\n"
      "R: go : here : * : * 1\nR: go : trap : * : * 1\n";
  EXPECT_THROW(Solve(ParseCassandraPomdp(text, "trap"), PomdpSolverKind::kCertified), NegativeResult);
}

TEST(SolvePomdp, WeakEvidenceAddsUp) {
  // One reading of one of four rocks leaves ceil(3 b(s)) as it is for all 16 states.
  const Pomdp pomdp = MakeRockSample(DrawRockSample(4, 4, 1));
  const PomdpResult truth = Solve(pomdp, PomdpSolverKind::kPointBased);
  PomdpSolverOptions options;
  options.kind = PomdpSolverKind::kRtdpBel;
  options.levels = 3;
  options.time_limit_s = 20.0;
  options.exact_trials = false;
  const PomdpResult labelled = SolvePomdp(pomdp, options);
  options.exact_trials = true;
  options.simulate = 2000;
  const PomdpResult exact = SolvePomdp(pomdp, options);
  EXPECT_EQ(labelled.status, SolverStatus::kConverged);
  EXPECT_EQ(exact.status, SolverStatus::kConverged);
  EXPECT_GT(exact.value_lower, labelled.value_lower + 0.05);
  EXPECT_GT(exact.value_lower, truth.value_upper - 0.1);
  EXPECT_LE(exact.value_lower, truth.value_upper + 1e-9);
  ASSERT_TRUE(exact.simulated);
  EXPECT_NEAR(exact.simulated->mean, exact.value_lower, 2.0 * exact.simulated->half_width);
}

TEST(SolvePomdp, NoiseWithoutDiscountThatDiscretisedBeliefsDoNotShow) {
  LatticeProblemData data;
  data.name = "noisy slot";
  data.size = Cell(11, 8, 1);
  data.start = Cell(1, 7, 0);
  data.tool = {Cell::Zero()};
  for (int x = 1; x <= 8; ++x) {
    data.target.emplace_back(x, 1, 0);
    if (x != 4) data.target.emplace_back(x, 2, 0);
  }
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 3; ++y) data.hypotheses.push_back({Cell(x, y, 0), 0, 1.0});
  }
  data.move_lengths = {1, 2, 4};
  data.cost = {1.0, 0.5, 0.1};
  const Pomdp pomdp = MakeNoisyPomdp({MakeLatticeProblem(data), {0.02, 0.01, 0.01}, {0.6, 100.0}});
  const PomdpResult truth = Solve(pomdp, PomdpSolverKind::kCertified);
  ASSERT_EQ(truth.status, SolverStatus::kConverged);
  PomdpSolverOptions options;
  options.kind = PomdpSolverKind::kRtdpBel;
  options.levels = 30;
  options.expansion_limit = 50'000;
  const PomdpResult result = SolvePomdp(pomdp, options);
  EXPECT_LE(result.value_lower, truth.value_upper + 1e-9);
  EXPECT_GT(result.value_lower, 1.5 * truth.value_lower);  // costs, negated
}

TEST(SolvePomdp, ExperienceOfTheProblemItself) {
  const Pomdp pomdp = MakeRockSample(DrawRockSample(3, 2, 2));
  const PomdpResult plain = Solve(pomdp, PomdpSolverKind::kRtdpBel);
  const PomdpResult none = Solve(pomdp, PomdpSolverKind::kERtdpBel);
  EXPECT_EQ(plain.value_lower, none.value_lower);
  EXPECT_EQ(plain.expansions, none.expansions);
  const PomdpResult best = Solve(pomdp, PomdpSolverKind::kPointBased);
  PomdpSolverOptions options;
  options.kind = PomdpSolverKind::kERtdpBel;
  options.experience = &*best.controller;
  options.epsilon = 1.5;
  const PomdpResult with = SolvePomdp(pomdp, options);
  options.experience = nullptr;
  const PomdpResult without = SolvePomdp(pomdp, options);
  EXPECT_GE(with.value_lower, without.value_lower - 1e-9);
}

TEST(SolvePomdp, SameSeedSameResult) {
  const Pomdp pomdp = MakeRockSample(DrawRockSample(4, 3, 1));
  for (const PomdpSolverKind kind :
       {PomdpSolverKind::kPointBased, PomdpSolverKind::kCertified, PomdpSolverKind::kRtdpBel}) {
    PomdpSolverOptions options;
    options.kind = kind;
    options.expansion_limit = 300;
    const PomdpResult a = SolvePomdp(pomdp, options);
    const PomdpResult b = SolvePomdp(pomdp, options);
    EXPECT_EQ(a.value_lower, b.value_lower);
    EXPECT_EQ(a.value_upper, b.value_upper);
    EXPECT_EQ(a.expansions, b.expansions);
  }
}

TEST(SolvePomdp, LimitsStopIt) {
  const Pomdp pomdp = MakeRockSample(DrawRockSample(5, 5, 1));
  PomdpSolverOptions options;
  options.expansion_limit = 50;
  EXPECT_EQ(SolvePomdp(pomdp, options).status, SolverStatus::kExpansionLimit);
  options = {};
  options.memory_limit_bytes = 1 << 20;
  const PomdpResult result = SolvePomdp(pomdp, options);
  EXPECT_EQ(result.status, SolverStatus::kMemoryLimit);
  EXPECT_LE(result.value_lower, result.value_upper);
  // Too little for the outcomes of the classes: what needs no search is left.
  options.memory_limit_bytes = 1 << 10;
  const PomdpResult none = SolvePomdp(pomdp, options);
  EXPECT_EQ(none.status, SolverStatus::kMemoryLimit);
  ASSERT_TRUE(none.controller);
  ASSERT_FALSE(none.alphas.empty());
  EXPECT_GE(EvaluateController(pomdp, *none.controller)->value, none.value_lower - 1e-9);
  CancellationToken token;
  token.Cancel();
  options = {};
  options.cancellation = &token;
  EXPECT_EQ(SolvePomdp(pomdp, options).status, SolverStatus::kCancelled);
}

TEST(SolvePomdp, LargeRewardsEndTheSearch) {
  // The tiger with other rewards: what a search leaves out as rounding must not be what the precision asks for.
  const auto tiger = [](const std::string& bad, const std::string& listen) {
    std::string text = kTiger;
    for (std::size_t at = text.find("-100\n"); at != std::string::npos; at = text.find("-100\n", at)) {
      text.replace(at, 4, bad);
      at += bad.size();
    }
    return ParseCassandraPomdp(text.replace(text.find("* -1\n") + 2, 2, listen), "tiger");
  };
  for (const std::string bad : {"-1e6", "-1e8", "-1e12"}) {
    const PomdpResult result = Solve(tiger(bad, "-1"), PomdpSolverKind::kPointBased);
    EXPECT_TRUE(result.status == SolverStatus::kConverged || result.status == SolverStatus::kRounding);
    EXPECT_GE(result.value_upper, result.value_lower);
  }
}

TEST(SolvePomdp, LongChainsToAGoal) {
  constexpr int kLength = 20000;
  std::string text = "discount: 1\nvalues: cost\nstates: " + std::to_string(kLength) +
                     "\nactions: 1\nobservations: 1\nstart: 0\nO: * uniform\n";
  for (int s = 0; s < kLength; ++s) {
    const int next = std::min(s + 1, kLength - 1);
    text += "T: 0 : " + std::to_string(s) + " : " + std::to_string(next) + " 1\n";
    if (s + 1 < kLength) text += "R: 0 : " + std::to_string(s) + " : * : * 1\n";
  }
  const Pomdp chain = ParseCassandraPomdp(text, "chain");
  const std::vector<std::uint8_t> ending = SurelyEnding(chain, {});
  EXPECT_EQ(std::ranges::count(ending, 1), kLength);
  const auto value = EvaluateController(chain, {{{0, {}, 0}}, 0});
  ASSERT_TRUE(value);
  EXPECT_NEAR(value->value, 1.0 - kLength, 1e-6);
}

TEST(SimulatePomdp, EpisodesThatAreCutShortAreCounted) {
  Pomdp tiger = ParseCassandraPomdp(kTiger, "tiger");
  const PomdpController listen{{{0, {}, 0}}, 0};
  ControllerAgent agent(listen);
  SimulationOptions options;
  options.episodes = 1;
  const SimulationResult whole = SimulatePomdp(tiger, agent, options);
  EXPECT_EQ(whole.cut_short, 0);
  EXPECT_NEAR(whole.mean, -20.0, 1e-4);
  EXPECT_GT(whole.steps_mean, 300.0);
  EXPECT_FALSE(std::isfinite(whole.half_width));
  options.max_steps = 1000;  // more than matter
  EXPECT_EQ(SimulatePomdp(tiger, agent, options).cut_short, 0);
  options.max_steps = 10;
  EXPECT_EQ(SimulatePomdp(tiger, agent, options).cut_short, 1);
  tiger.discount = 0.99999999;
  options.max_steps = 0;
  const SimulationResult long_run = SimulatePomdp(tiger, agent, options);
  EXPECT_EQ(long_run.cut_short, 1);
  EXPECT_GE(long_run.steps_mean, 1e6);
}

}  // namespace
}  // namespace feeler::planner
