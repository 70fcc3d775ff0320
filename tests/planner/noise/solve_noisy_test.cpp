// Laws of noisy problems:
// - lower bound and cost meet the optimum of an independent judge, who looks through every history from the definitions
//   alone; with and without costs of contacts and actions, and with another prior;
// - the policy costs the same in the tables that are exported, evaluated as a controller of a general POMDP;
// - what a policy is said to cost is what its replay costs under each hypothesis, and what episodes cost on average;
// - without noise the optimum is that of the problem without noise; missed contacts alone never make it cheaper;
// - nothing is declared below the confidence asked for; confidence never makes it cheaper, nor does the cost of errors;
// - same problem and options, same policy.
#include "feeler/planner/noise/solve_noisy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/noise/noisy_pomdp.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/model/controller.h"
#include "feeler/planner/pomdp/search/solve_pomdp.h"
#include "feeler/planner/solve.h"
#include "tests/planner/noise/slot.h"
#include "tests/planner/random_problems.h"

namespace feeler::planner {
namespace {

NoisyProblem Noisy(const LatticeProblemData& data, const Noise& noise, double confidence = 0.51) {
  return {MakeLatticeProblem(data), noise, {confidence, 100.0}};
}

NoisyResult Solve(const NoisyProblem& noisy, double gap, std::int64_t expansions = 1000) {
  SolverOptions options;
  options.gap = gap;
  options.expansion_limit = expansions;
  return SolveNoisy(noisy, options);
}

/// The judge: every history of at most so many moves, from the definitions of the file and of the noise alone. Costs of
/// the best policy that ends within them (no less than the optimum), or to which what follows costs nothing (no more).
class LookAhead {
 public:
  LookAhead(const LatticeProblemData& data, const NoisyProblem& noisy, bool free_after)
      : data_(data), noisy_(noisy), free_after_(free_after) {}

  double Cost(const Cell& robot, const std::vector<double>& weights, int moves) {
    const double most = *std::ranges::max_element(weights);
    double best = noisy_.WrongCost() * (most >= noisy_.declaration.confidence ? 1.0 - most : 1.0);
    if (moves == 0) return free_after_ ? 0.0 : best;
    std::vector<long long> key = {robot.x(), robot.y(), moves};
    for (const double w : weights) key.push_back(std::llround(w * 1e10));
    if (const auto known = known_.find(key); known != known_.end()) return known->second;
    for (const Direction d : kDirections) {
      for (const int cells : data_.move_lengths) {
        const Cell far = robot + cells * UnitCell(d);
        if ((far.array() < 0).any() || (far.array() >= data_.size.array()).any()) continue;
        best = std::min(best, Of({d, cells}, robot, weights, moves));
      }
    }
    known_[key] = best;
    return best;
  }

 private:
  struct Part {
    std::vector<double> weights;
    double probability = 0.0;
  };
  using Parts = std::map<std::pair<int, bool>, Part>;

  double Of(const GuardedMove& move, const Cell& robot, const std::vector<double>& weights, int moves) {
    Parts parts;
    double cost = data_.cost.per_action;
    for (std::size_t h = 0; h < weights.size(); ++h) {
      if (weights[h] > 0.0) Follow(move, robot, h, move.cells, 0, weights[h], parts, cost);
    }
    for (auto& [outcome, part] : parts) {
      for (double& w : part.weights) w /= part.probability;
      cost += part.probability * Cost(robot + outcome.first * UnitCell(move.direction), part.weights, moves - 1);
    }
    return cost;
  }

  void Follow(const GuardedMove& move, const Cell& robot, std::size_t h, int left, int on, double probability,
              Parts& parts, double& cost) {
    if (probability == 0.0) return;
    const auto end = [&](bool contact, double p) {
      if (p == 0.0) return;
      Part& part = parts[{on, contact}];
      part.weights.resize(data_.hypotheses.size(), 0.0);
      part.weights[h] += p;
      part.probability += p;
    };
    if (left == 0) return end(false, probability);
    const Cell next = robot + (on + 1) * UnitCell(move.direction);
    bool blocked = false;
    for (const Cell& target : data_.target) blocked = blocked || next == target + data_.hypotheses[h].offset;
    const Noise& noise = noisy_.noise;
    const double contact = blocked ? 1.0 - noise.missed_contact : noise.false_stop;
    const double stays = blocked ? noise.missed_contact : noise.slip;
    end(true, probability * contact);
    cost += probability * (contact * data_.cost.per_contact + (1.0 - contact) * data_.cost.per_cell);
    Follow(move, robot, h, left - 1, on, probability * stays, parts, cost);
    Follow(move, robot, h, left - 1, on + 1, probability * (1.0 - contact - stays), parts, cost);
  }

  const LatticeProblemData& data_;
  const NoisyProblem& noisy_;
  bool free_after_;
  std::map<std::vector<long long>, double> known_;
};

/// A corner, two or three places.
LatticeProblemData Corner(int places) {
  LatticeProblemData data = Slot();
  data.name = "corner";
  data.size = Cell(4, 4, 1);
  data.start = Cell(1, 3, 0);
  data.target = {Cell(1, 1, 0), Cell(2, 1, 0), Cell(2, 0, 0)};
  data.hypotheses.resize(static_cast<std::size_t>(places));
  data.move_lengths = {1, 2};
  return data;
}

void ExpectOptimum(const LatticeProblemData& data, const Noise& noise, double confidence, int moves, double horizon) {
  const NoisyProblem noisy = Noisy(data, noise, confidence);
  const NoisyResult result = Solve(noisy, 1.005, 5000);
  std::vector<double> weights;
  double sum = 0.0;
  for (const Hypothesis& h : data.hypotheses) sum += h.weight;
  for (const Hypothesis& h : data.hypotheses) weights.push_back(h.weight / sum);
  const double high = LookAhead(data, noisy, false).Cost(data.start, weights, moves);
  const double low = LookAhead(data, noisy, true).Cost(data.start, weights, moves);
  const double cost = result.evaluation.expected_cost;
  SCOPED_TRACE(::testing::Message() << data.name << ": " << result.lower_bound << " to " << cost << ", judge " << low
                                    << " to " << high);
  EXPECT_LE(result.Ratio(), 1.005 + 1e-4);
  EXPECT_LE(result.lower_bound, high + 1e-6);
  EXPECT_LE(low, cost + 1e-6);
  EXPECT_LE(high, cost * horizon);
}

TEST(SolveNoisy, FindsTheOptimum) {
  ExpectOptimum(Corner(2), {0.02, 0.0, 0.0}, 0.99, 9, 1.01);
  ExpectOptimum(Corner(2), {0.05, 0.05, 0.05}, 0.99, 9, 1.01);
  ExpectOptimum(Corner(2), {0.0, 0.1, 0.2}, 0.9, 9, 1.05);
  LatticeProblemData other = Corner(3);
  other.cost = {1.0, 0.5, 0.5};
  other.hypotheses[1].weight = 3.0;
  ExpectOptimum(other, {0.05, 0.05, 0.02}, 0.95, 6, 1.1);
}

/// The same policy in the tables that are exported, by the linear system of general POMDPs.
TEST(SolveNoisy, CostsTheSameInTheExportedModel) {
  LatticeProblemData data = Corner(3);
  data.cost = {1.0, 0.5, 0.25};
  const NoisyProblem noisy = Noisy(data, {0.1, 0.05, 0.1});
  const NoisyResult result = Solve(noisy, 1.05);
  const Pomdp pomdp = ParseCassandraPomdp(FormatCassandraPomdp(MakeNoisyPomdp(noisy)), "noisy");
  const auto number = [](const std::vector<std::string>& names, const std::string& name) {
    return static_cast<std::uint32_t>(std::ranges::find(names, name) - names.begin());
  };
  PomdpController controller;
  std::vector<Cell> robot(result.policy.nodes.size(), data.start);
  std::vector<std::uint32_t> order = {result.policy.root};
  std::vector<char> met(robot.size(), 0);
  met[result.policy.root] = 1;
  controller.root = result.policy.root;
  controller.nodes.resize(robot.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const NoisyPolicy::Node& node = result.policy.nodes[order[i]];
    PomdpController::Node& its = controller.nodes[order[i]];
    its.otherwise = order[i];
    if (node.ends()) {
      its.action = number(pomdp.actions, "declare_" + std::to_string(node.declared.empty() ? 0 : node.declared[0]));
      continue;
    }
    const Direction d = node.move.direction;
    its.action = number(pomdp.actions, std::string(SignOf(d) > 0 ? "plus_" : "minus_") + "xyz"[AxisOf(d)] +
                                           std::to_string(node.move.cells));
    for (const NoisyPolicy::Branch& branch : node.branches) {
      const Cell at = robot[order[i]] + branch.outcome.cells * UnitCell(d);
      const std::string seen = (branch.outcome.contact ? "c" : "r") + std::to_string(at.x()) + "_" +
                               std::to_string(at.y()) + "_" + std::to_string(at.z());
      its.branches.push_back({number(pomdp.observations, seen), branch.next});
      if (met[branch.next] == 0) order.push_back(branch.next);
      met[branch.next] = 1;
      robot[branch.next] = at;
    }
    std::ranges::sort(its.branches, {}, &PomdpController::Branch::observation);
  }
  const auto value = EvaluateController(pomdp, controller);
  ASSERT_TRUE(value);
  EXPECT_NEAR(-value->value, result.evaluation.expected_cost, 1e-3);
}

// Walls cost nothing to touch here, and a touch that leaves all as it is comes back for nothing: a search that does not
// see through that goes round there for ever.
TEST(SolveNoisy, TheSearchOfGeneralModelsFindsTheSameOptimumInTheExportedModel) {
  for (const Noise& noise : {Noise{0.02, 0.0, 0.0}, Noise{0.1, 0.02, 0.02}}) {
    const NoisyProblem noisy = Noisy(Slot(), noise);
    const NoisyResult own = Solve(noisy, 1.0005, 20000);
    PomdpSolverOptions options;
    options.kind = PomdpSolverKind::kCertified;
    options.precision = 0.01;
    options.expansion_limit = 20000;
    options.time_limit_s = 100.0;  // only to end what goes round
    const PomdpResult general = SolvePomdp(MakeNoisyPomdp(noisy), options);
    EXPECT_EQ(general.status, SolverStatus::kConverged);
    EXPECT_LE(-general.value_upper, own.evaluation.expected_cost + 1e-6);
    EXPECT_GE(-general.value_lower, own.lower_bound - 1e-6);
    EXPECT_NEAR(-general.value_lower, own.evaluation.expected_cost, 0.02);
    ASSERT_TRUE(general.controller);
    const auto value = EvaluateController(MakeNoisyPomdp(noisy), *general.controller);
    ASSERT_TRUE(value);
    EXPECT_GE(value->value, general.value_lower - 1e-6) << "the controller is worth what is said";
    EXPECT_LE(value->value, general.value_upper + 1e-6);
  }
}

TEST(SolveNoisy, BothFormatsReadBackToTheSameModel) {
  const Pomdp model = MakeNoisyPomdp(Noisy(Slot(), {0.05, 0.02, 0.01}));
  const Pomdp read = ParsePomdpx(FormatPomdpx(model), "noisy.pomdpx");
  ASSERT_EQ(read.state_count(), model.state_count());
  ASSERT_EQ(read.actions, model.actions);
  EXPECT_EQ(read.discount, model.discount);
  std::vector<std::size_t> number(model.state_count(), model.state_count());
  for (std::size_t s = 0; s < model.state_count(); ++s) {
    for (std::size_t r = 0; r < read.state_count(); ++r) {
      if (read.states[r].find(model.states[s]) != std::string::npos &&
          read.states[r].size() <= model.states[s].size() + 10) {
        number[s] = r;
      }
    }
    ASSERT_LT(number[s], read.state_count()) << model.states[s];
  }
  const auto by_name = [](const SparseRows& rows, std::size_t row, const std::vector<std::string>& names) {
    std::map<std::string, double> sum;
    for (const SparseEntry& e : rows.Row(row)) sum[names[e.index]] += e.value;
    return sum;
  };
  for (std::size_t a = 0; a < model.action_count(); ++a) {
    for (std::size_t s = 0; s < model.state_count(); ++s) {
      EXPECT_NEAR(read.reward[read.At(a, number[s])], model.reward[model.At(a, s)], 1e-12);
      EXPECT_EQ(by_name(read.observation_rows, read.At(a, number[s]), read.observations),
                by_name(model.observation_rows, model.At(a, s), model.observations));
      for (const SparseEntry& e : model.transitions.Row(model.At(a, s))) {
        double probability = 0.0;
        for (const SparseEntry& f : read.transitions.Row(read.At(a, number[s]))) {
          if (f.index == number[e.index]) probability += f.value;
        }
        EXPECT_NEAR(probability, e.value, 1e-12);
      }
    }
  }
}

TEST(SolveNoisy, WithoutNoiseIsTheProblemWithoutNoise) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    const LatticeProblemData data = testing::RandomProblem(21, seed, {});
    const Problem problem = MakeLatticeProblem(data);
    SolverOptions options;
    options.gap = 1.0;
    const SolverResult exact = Solve(problem, options);
    if (!exact.complete()) continue;
    NoisyProblem noisy = Noisy(data, {}, 0.99);
    noisy.declaration.wrong_cells = 1000.0;
    const NoisyResult result = Solve(noisy, 1.0, 20000);
    EXPECT_NEAR(result.evaluation.expected_cost, exact.expected_cost, 1e-6) << seed;
    EXPECT_NEAR(result.lower_bound, exact.expected_cost, 2e-3) << seed;
    EXPECT_NEAR(result.evaluation.right, 1.0, 1e-9);
  }
}

TEST(SolveNoisy, MissedContactsNeverPay) {
  double before = 0.0;
  for (const double missed : {0.0, 0.01, 0.05, 0.2, 0.5}) {
    const NoisyResult result = Solve(Noisy(Slot(), {missed, 0.0, 0.0}), 1.0, 20000);
    EXPECT_EQ(result.status, SolverStatus::kConverged);
    EXPECT_GE(result.evaluation.expected_cost, before - 1e-4) << missed;
    before = result.evaluation.expected_cost;
  }
}

TEST(SolveNoisy, DeclaresAtTheConfidenceAskedFor) {
  double before = 0.0;
  for (const double confidence : {0.6, 0.95, 0.999}) {
    const NoisyProblem noisy = Noisy(Slot(), {0.1, 0.1, 0.05}, confidence);
    const NoisyResult result = Solve(noisy, 1.02);
    int ends = 0;
    for (const NoisyPolicy::Node& node : result.policy.nodes) {
      if (!node.ends() || node.declared.empty()) continue;
      EXPECT_GE(node.confidence, confidence - 1e-9);
      ++ends;
    }
    EXPECT_GT(ends, 3);
    EXPECT_GE(result.evaluation.expected_cost, before - 1e-6);
    before = result.lower_bound;
    EXPECT_NEAR(result.evaluation.right + result.evaluation.wrong + result.evaluation.given_up, 1.0, 1e-9);
  }
}

/// One episode by the definition of the file's world, step by step; returns its cost.
double Episode(const NoisyProblem& noisy, const NoisyPolicy& policy, int truth, RandomStream& random) {
  const Problem& problem = noisy.problem;
  const Hypothesis& h = problem.hypotheses[static_cast<std::size_t>(truth)];
  Cell robot = problem.start;
  double cost = 0.0;
  std::uint32_t at = policy.root;
  while (!policy.nodes[at].ends()) {
    const NoisyPolicy::Node& node = policy.nodes[at];
    Outcome outcome;
    for (int step = 0; step < node.move.cells && !outcome.contact; ++step) {
      const Cell next = robot + UnitCell(node.move.direction);
      const double drawn = random.Uniform();
      if (Blocked(problem, next, h)) {
        outcome.contact = drawn >= noisy.noise.missed_contact;
      } else if (drawn < noisy.noise.false_stop) {
        outcome.contact = true;
      } else if (drawn >= noisy.noise.false_stop + noisy.noise.slip) {
        robot = next;
        ++outcome.cells;
      }
      if (!outcome.contact) cost += problem.cost.per_cell;
    }
    cost += problem.cost.per_action + (outcome.contact ? problem.cost.per_contact : 0.0);
    std::uint32_t next = at;
    bool known = false;
    for (const NoisyPolicy::Branch& branch : node.branches) {
      if (branch.outcome == outcome) next = branch.next, known = true;
    }
    if (!known) return cost + noisy.WrongCost();
    at = next;
  }
  const std::vector<int>& declared = policy.nodes[at].declared;
  const bool right = std::find(declared.begin(), declared.end(), truth) != declared.end();
  return cost + (right ? 0.0 : noisy.WrongCost());
}

TEST(SolveNoisy, CostsWhatEpisodesCost) {
  LatticeProblemData data = Slot();
  data.cost = {1.0, 0.25, 0.5};
  const NoisyProblem noisy = Noisy(data, {0.1, 0.05, 0.1}, 0.99);
  const NoisyResult result = Solve(noisy, 1.05);
  const std::vector<double> replayed = ReplayNoisyPolicy(noisy, result.policy);
  double mean = 0.0;
  for (int truth = 0; truth < 4; ++truth) {
    mean += replayed[static_cast<std::size_t>(truth)] / 4.0;
    RandomStream random(7, static_cast<std::uint64_t>(truth), "episodes");
    constexpr int kEpisodes = 5000;
    double sum = 0.0;
    double squares = 0.0;
    for (int k = 0; k < kEpisodes; ++k) {
      const double cost = Episode(noisy, result.policy, truth, random);
      sum += cost;
      squares += cost * cost;
    }
    const double average = sum / kEpisodes;
    const double deviation = std::sqrt((squares / kEpisodes - average * average) / kEpisodes);
    EXPECT_NEAR(average, replayed[static_cast<std::size_t>(truth)], 4.0 * deviation + 1e-9) << truth;
  }
  EXPECT_NEAR(mean, result.evaluation.expected_cost, 1e-9);
  EXPECT_NEAR(result.policy.nodes[result.policy.root].expected_cost, mean, 1e-4);
}

TEST(SolveNoisy, SameAgain) {
  const NoisyProblem noisy = Noisy(Slot(), {0.05, 0.05, 0.05}, 0.99);
  const NoisyResult a = Solve(noisy, 1.02);
  const NoisyResult b = Solve(noisy, 1.02);
  EXPECT_EQ(a.evaluation.expected_cost, b.evaluation.expected_cost);
  EXPECT_EQ(a.lower_bound, b.lower_bound);
  EXPECT_EQ(a.policy.nodes.size(), b.policy.nodes.size());
  SolverOptions options;
  options.solver = SolverKind::kRtdpBel;
  options.epsilon = 1.0;
  options.expansion_limit = 500;
  const NoisyResult rtdp = SolveNoisy(noisy, options);
  EXPECT_LE(a.lower_bound, rtdp.evaluation.expected_cost + 1e-6);
  EXPECT_LE(rtdp.lower_bound, a.evaluation.expected_cost + 1e-6);
}

}  // namespace
}  // namespace feeler::planner
