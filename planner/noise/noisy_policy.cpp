#include "feeler/planner/noise/noisy_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <tuple>
#include <utility>

#include "feeler/planner/noise/markov_chain.h"

namespace feeler::planner {
namespace {

/// Nodes that a replay reaches more rarely count as given up: all of them together, some 1e-8 of that cost.
constexpr double kLeastReplayed = 1e-13;
constexpr std::uint32_t kNotMet = std::numeric_limits<std::uint32_t>::max();

struct Place {
  std::uint32_t belief = 0;
  double cost = 0.0;
};

/// The graph of beliefs that a policy meets, most probable first, as nodes; costs of their moves beside them.
void Collect(NoisyBeliefGraph& graph, const std::function<GuardedMove(std::uint32_t)>& move_of, double least_reach,
             const std::function<bool(std::size_t)>& late, NoisyPolicy& policy, std::vector<Place>& places) {
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
    const bool ends = mass < least_reach || (late && late(places.size()));
    const GuardedMove move = ends ? GuardedMove{Direction::kPlusX, 0} : move_of(b);
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

MarkovChain ChainOf(const NoisyPolicy& policy) {
  MarkovChain chain;
  for (const NoisyPolicy::Node& node : policy.nodes) {
    chain.AddState();
    for (const NoisyPolicy::Branch& branch : node.branches) chain.AddStep(branch.next, branch.probability);
  }
  return chain;
}

/// A policy under one hypothesis: a Markov chain over its nodes (each knows the robot's cell, being one belief), the
/// most probable ones first. A move that leads back to its node is repeated so often as `repeats` says, then given up;
/// so are nodes that are reached with less than kLeastReplayed.
class Replay {
 public:
  Replay(const NoisyProblem& noisy, const NoisyPolicy& policy, const std::vector<int>& repeats)
      : noisy_(noisy), policy_(policy), repeats_(repeats), moves_(noisy.noise) {}

  double CostUnder(std::size_t h) {
    places_.assign(policy_.nodes.size(), {});
    places_[policy_.root] = {1.0, kNotMet, noisy_.problem.start};
    costs_.clear();
    first_.clear();
    steps_.clear();
    queue_.emplace(1.0, policy_.root);
    while (!queue_.empty()) {
      const std::uint32_t n = queue_.top().second;
      queue_.pop();
      if (places_[n].state != kNotMet || places_[n].reach < kLeastReplayed) continue;
      places_[n].state = static_cast<std::uint32_t>(costs_.size());
      Follow(n, h);
    }
    MarkovChain chain;
    const auto given_up = static_cast<std::uint32_t>(costs_.size());
    for (std::size_t i = 0; i < costs_.size(); ++i) {
      chain.AddState();
      const std::size_t end = i + 1 < costs_.size() ? first_[i + 1] : steps_.size();
      for (std::size_t s = first_[i]; s < end; ++s) {
        chain.AddStep(std::min(places_[steps_[s].first].state, given_up), steps_[s].second);
      }
    }
    chain.AddState();
    costs_.push_back(noisy_.WrongCost());
    return chain.ExpectedSums(costs_, noisy_.WrongCost())[0];
  }

 private:
  struct Place {
    double reach = 0.0;
    std::uint32_t state = kNotMet;  ///< of the chain
    Cell robot = Cell::Zero();
  };

  void Follow(std::uint32_t n, std::size_t h) {
    const NoisyPolicy::Node& node = policy_.nodes[n];
    const std::size_t first = steps_.size();
    first_.push_back(first);
    if (node.ends()) {
      const bool right = std::ranges::count(node.declared, static_cast<int>(h)) > 0;
      costs_.push_back(right ? 0.0 : noisy_.WrongCost());
      return;
    }
    const Problem& problem = noisy_.problem;
    const Place here = places_[n];
    const NoisyMove& does =
        moves_.Of(node.move.cells, Simulate(problem, here.robot, node.move, problem.hypotheses[h]).cells);
    double cost = does.Cost(problem.cost, node.move.direction);
    double stays = 0.0;
    for (const NoisyOutcome& o : does.outcomes) {
      const auto branch = std::ranges::find(node.branches, o.outcome, &NoisyPolicy::Branch::outcome);
      if (branch == node.branches.end()) {  // improbable beyond rounding: as given up
        cost += o.probability * noisy_.WrongCost();
      } else if (branch->next == n) {
        stays += o.probability;
      } else {
        steps_.emplace_back(branch->next, o.probability);
        places_[branch->next].robot = here.robot + o.outcome.cells * UnitCell(node.move.direction);
      }
    }
    const double made = repeats_[n] + 1.0;
    const double left = std::pow(stays, made);
    const double times = stays < 1.0 ? (1.0 - left) / (1.0 - stays) : made;
    costs_.push_back(times * cost + left * noisy_.WrongCost());
    for (std::size_t s = first; s < steps_.size(); ++s) {
      steps_[s].second *= times;
      Place& there = places_[steps_[s].first];
      there.reach += here.reach * steps_[s].second;
      if (there.state == kNotMet) queue_.emplace(there.reach, steps_[s].first);
    }
  }

  const NoisyProblem& noisy_;
  const NoisyPolicy& policy_;
  const std::vector<int>& repeats_;
  NoisyMoves moves_;
  std::vector<Place> places_;       ///< by node
  std::vector<double> costs_;       ///< by state of the chain
  std::vector<std::size_t> first_;  ///< of steps_, by state
  std::vector<std::pair<std::uint32_t, double>> steps_;
  std::priority_queue<std::pair<double, std::uint32_t>> queue_;
};

}  // namespace

NoisyPolicy FreezeNoisyPolicy(NoisyBeliefGraph& graph, const std::function<GuardedMove(std::uint32_t)>& move_of,
                              double least_reach, NoisyEvaluation* evaluation, std::vector<std::uint32_t>* beliefs,
                              const std::function<bool(std::size_t)>& late) {
  NoisyPolicy policy;
  std::vector<Place> places;
  Collect(graph, move_of, least_reach, late, policy, places);
  const std::size_t count = policy.nodes.size();
  std::vector<double> at(count);
  for (std::size_t n = 0; n < count; ++n) at[n] = places[n].cost;
  MarkovChain chain = ChainOf(policy);
  const std::vector<double> cost = chain.ExpectedSums(at, 0.0);
  for (std::size_t n = 0; n < count; ++n) policy.nodes[n].expected_cost = cost[n];
  for (std::size_t n = 0; beliefs != nullptr && n < count; ++n) beliefs->push_back(places[n].belief);
  if (evaluation == nullptr) return policy;
  const auto of = [&](const std::function<double(const NoisyPolicy::Node&)>& value) {
    for (std::size_t n = 0; n < count; ++n) at[n] = value(policy.nodes[n]);
    return chain.ExpectedSums(at, 0.0)[policy.root];
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
  std::vector<int> repeats;
  for (std::uint32_t n = 0; n < policy.nodes.size(); ++n) {
    double stays = 0.0;
    for (const NoisyPolicy::Branch& branch : policy.nodes[n].branches) {
      if (branch.next == n) stays += branch.probability;
    }
    repeats.push_back(MostRepeats(stays));
  }
  Replay replay(noisy, policy, repeats);
  std::vector<double> costs;
  for (std::size_t h = 0; h < noisy.problem.hypotheses.size(); ++h) costs.push_back(replay.CostUnder(h));
  return costs;
}

}  // namespace feeler::planner
