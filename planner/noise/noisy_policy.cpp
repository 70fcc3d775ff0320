#include "feeler/planner/noise/noisy_policy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <queue>
#include <tuple>
#include <utility>

namespace feeler::planner {
namespace {

/// Sweeps stop where none changes more than this, relative to the cost of being wrong.
constexpr double kSettled = 1e-13;
constexpr int kMostSweeps = 100000;

struct Place {
  std::uint32_t belief = 0;
  double cost = 0.0;
};

/// The graph of beliefs that a policy meets, most probable first, as nodes; costs of their moves beside them.
void Collect(NoisyBeliefGraph& graph, const std::function<GuardedMove(std::uint32_t)>& move_of, double least_reach,
             NoisyPolicy& policy, std::vector<Place>& places) {
  std::map<std::uint32_t, std::uint32_t> number = {{graph.Start(), 0}};
  std::vector<double> reach = {1.0};
  std::vector<std::uint8_t> done = {0};
  std::priority_queue<std::tuple<double, std::uint32_t>> queue;
  places.push_back({graph.Start(), 0.0});
  policy.nodes.emplace_back();
  queue.emplace(1.0, 0);
  while (!queue.empty()) {
    const auto [mass, n] = queue.top();
    queue.pop();
    if (done[n] != 0) continue;
    done[n] = 1;
    const std::uint32_t b = places[n].belief;
    const GuardedMove move = mass < least_reach ? GuardedMove{Direction::kPlusX, 0} : move_of(b);
    policy.nodes[n].move = move;
    if (move.cells == 0) {
      const int set = graph.Declared(b);
      if (set >= 0) policy.nodes[n].declared = graph.goal_sets()[static_cast<std::size_t>(set)];
      policy.nodes[n].confidence = set >= 0 ? graph.Confidence(b) : 0.0;
      places[n].cost = graph.EndCost(b);
      continue;
    }
    for (const NoisyBeliefGraph::Branch& branch : graph.Branches(b, move, &places[n].cost)) {
      const auto [at, added] = number.try_emplace(branch.belief, static_cast<std::uint32_t>(places.size()));
      if (added) {
        places.push_back({branch.belief, 0.0});
        policy.nodes.emplace_back();
        reach.push_back(0.0);
        done.push_back(0);
      }
      const std::uint32_t next = at->second;
      policy.nodes[n].branches.push_back({branch.outcome, next, branch.probability});
      reach[next] += mass * branch.probability;
      if (done[next] == 0) queue.emplace(reach[next], next);
    }
  }
}

/// Solves x(n) = at(n) + sum p x(next), with x(n) = at(n) at ends, from the values given (Gauss-Seidel, ends first). A
/// move that leads back to its node is repeated `repeats(n)` times, then paid for with `given_up`; for ever where there
/// are none.
void Settle(const NoisyPolicy& policy, const std::vector<double>& at, double scale, const std::vector<int>& repeats,
            double given_up, std::vector<double>& x) {
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0.0;
    for (std::size_t n = policy.nodes.size(); n-- > 0;) {
      double sum = at[n];
      double stays = 0.0;
      for (const NoisyPolicy::Branch& branch : policy.nodes[n].branches) {
        if (branch.next == n) {
          stays += branch.probability;
        } else {
          sum += branch.probability * x[branch.next];
        }
      }
      if (repeats.empty()) {
        sum /= 1.0 - stays;
      } else {
        double times = 0.0;
        double again = 1.0;
        for (int k = 0; k <= repeats[n]; ++k, again *= stays) times += again;
        sum = sum * times + again * given_up;
      }
      change = std::max(change, std::abs(sum - x[n]));
      x[n] = sum;
    }
    if (change <= kSettled * scale) return;
  }
}

}  // namespace

NoisyPolicy FreezeNoisyPolicy(NoisyBeliefGraph& graph, const std::function<GuardedMove(std::uint32_t)>& move_of,
                              double least_reach, NoisyEvaluation* evaluation, std::vector<std::uint32_t>* beliefs) {
  NoisyPolicy policy;
  std::vector<Place> places;
  Collect(graph, move_of, least_reach, policy, places);
  const std::size_t count = policy.nodes.size();
  const double wrong_cost = graph.noisy().WrongCost();
  std::vector<double> at(count), cost(count, 0.0);
  for (std::size_t n = 0; n < count; ++n) at[n] = places[n].cost;
  Settle(policy, at, wrong_cost, {}, 0.0, cost);
  for (std::size_t n = 0; n < count; ++n) policy.nodes[n].expected_cost = cost[n];
  for (std::size_t n = 0; beliefs != nullptr && n < count; ++n) beliefs->push_back(places[n].belief);
  if (evaluation == nullptr) return policy;
  const auto of = [&](const std::function<double(const NoisyPolicy::Node&)>& value) {
    std::vector<double> x(count, 0.0);
    for (std::size_t n = 0; n < count; ++n) at[n] = value(policy.nodes[n]);
    Settle(policy, at, 1.0, {}, 0.0, x);
    return x[policy.root];
  };
  using Node = NoisyPolicy::Node;
  evaluation->expected_cost = cost[policy.root];
  evaluation->right = of([](const Node& n) { return n.ends() ? n.confidence : 0.0; });
  evaluation->wrong = of([](const Node& n) { return n.ends() && !n.declared.empty() ? 1.0 - n.confidence : 0.0; });
  evaluation->given_up = of([](const Node& n) { return n.ends() && n.declared.empty() ? 1.0 : 0.0; });
  evaluation->moves = of([](const Node& n) { return n.ends() ? 0.0 : 1.0; });
  return policy;
}

int MostRepeats(double stays) {
  if (stays <= 0.0) return 0;
  constexpr int kMost = 1'000'000;
  return std::min(kMost, static_cast<int>(std::ceil(std::log(1e-18) / std::log(std::min(stays, 1.0 - 1e-6)))));
}

std::vector<double> ReplayNoisyPolicy(const NoisyProblem& noisy, const NoisyPolicy& policy) {
  const Problem& problem = noisy.problem;
  NoisyMoves moves(noisy.noise);
  std::vector<int> repeats;
  for (std::uint32_t n = 0; n < policy.nodes.size(); ++n) {
    double stays = 0.0;
    for (const NoisyPolicy::Branch& branch : policy.nodes[n].branches) {
      if (branch.next == n) stays += branch.probability;
    }
    repeats.push_back(MostRepeats(stays));
  }
  std::vector<double> costs;
  for (std::size_t h = 0; h < problem.hypotheses.size(); ++h) {
    // Under one hypothesis: a Markov chain over nodes (each node knows the robot's cell, being one belief).
    std::vector<Cell> robot(policy.nodes.size(), problem.start);
    std::vector<std::uint8_t> met(policy.nodes.size(), 0);
    std::vector<std::uint32_t> order = {policy.root};
    std::vector<double> at(policy.nodes.size(), 0.0);
    NoisyPolicy chain;
    chain.nodes.resize(policy.nodes.size());
    met[policy.root] = 1;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::uint32_t n = order[i];
      const NoisyPolicy::Node& node = policy.nodes[n];
      if (node.ends()) {
        at[n] = std::ranges::count(node.declared, static_cast<int>(h)) > 0 ? 0.0 : noisy.WrongCost();
        continue;
      }
      const int room = Simulate(problem, robot[n], node.move, problem.hypotheses[h]).cells;
      const NoisyMove& does = moves.Of(node.move.cells, room);
      at[n] = does.Cost(problem.cost, node.move.direction);
      for (const NoisyOutcome& o : does.outcomes) {
        const auto branch = std::ranges::find(node.branches, o.outcome, &NoisyPolicy::Branch::outcome);
        if (branch == node.branches.end()) {  // improbable beyond rounding: as given up
          at[n] += o.probability * noisy.WrongCost();
          continue;
        }
        chain.nodes[n].branches.push_back({o.outcome, branch->next, o.probability});
        if (met[branch->next] != 0) continue;
        met[branch->next] = 1;
        robot[branch->next] = robot[n] + o.outcome.cells * UnitCell(node.move.direction);
        order.push_back(branch->next);
      }
    }
    std::vector<double> x(policy.nodes.size(), 0.0);
    Settle(chain, at, noisy.WrongCost(), repeats, noisy.WrongCost(), x);
    costs.push_back(x[policy.root]);
  }
  return costs;
}

}  // namespace feeler::planner
