#include "feeler/planner/noise/confirmed_policy.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>

namespace feeler::planner {
namespace {

/// Beliefs whose share of the cost, were they given up, is below this are left out; and at most so many in all.
constexpr double kLeast = 1e-6;
constexpr std::size_t kMost = 100'000;
constexpr GuardedMove kEnd{Direction::kPlusX, 0};

}  // namespace

ConfirmedPolicy::ConfirmedPolicy(NoisyBeliefGraph& graph, const PlanningTables& tables)
    : graph_(graph),
      sure_(graph.noisy().problem, tables.masks(), false),
      heuristic_(tables.MakeHeuristic(graph.noisy().problem, sure_.sets())),
      greedy_(sure_) {
  sure_.SetHeuristic(heuristic_.get());
}

GuardedMove ConfirmedPolicy::Choose(std::uint32_t b, const Stop& stop) {
  if (graph_.Declared(b) >= 0) return kEnd;
  std::vector<WeightedHypothesis> likely(graph_.Belief(b).begin(), graph_.Belief(b).end());
  std::ranges::stable_sort(likely, std::greater<>(), &WeightedHypothesis::weight);
  const Problem& problem = graph_.noisy().problem;
  std::vector<Hypothesis> set;
  double sum = 0.0;
  for (std::size_t i = 0; i < likely.size(); ++i) {
    // Equally likely ones come along.
    if (sum >= graph_.noisy().declaration.confidence && likely[i].weight < likely[i - 1].weight * (1.0 - 1e-9)) break;
    set.push_back(problem.hypotheses[likely[i].hypothesis]);
    sum += likely[i].weight;
  }
  const std::optional<SetId> id = sure_.sets().Find(set);
  if (!id || sure_.sets().info(*id).goal) return kEnd;
  const BeliefId belief = sure_.Intern(*id, graph_.Robot(b));
  if (!greedy_.Solved(belief) && greedy_.Run(belief, stop)) return kEnd;
  const BeliefAction& action = sure_.Actions(belief)[static_cast<std::size_t>(greedy_.Action(belief))];
  return {action.direction, action.cells};
}

void ConfirmedPolicy::Run(const Stop& stop) {
  std::priority_queue<std::tuple<double, std::uint32_t>> queue;
  std::vector<double> reach(1, 1.0);
  std::vector<std::uint8_t> done(1, 0);
  queue.emplace(1.0, graph_.Start());
  const double least = kLeast * graph_.EndCost(graph_.Start()) / graph_.noisy().WrongCost();
  while (!queue.empty() && order_.size() < kMost && !stop(expansions())) {
    const auto [mass, b] = queue.top();
    queue.pop();
    if (done[b] != 0) continue;
    if (mass < least) break;
    done[b] = 1;
    const GuardedMove move = Choose(b, stop);
    if (move.cells == 0) continue;
    Step step{b, 0.0, branches_.size(), 0};
    const std::vector<NoisyBeliefGraph::Branch> branches = graph_.Branches(b, move, &step.cost);
    step.count = branches.size();
    if (reach.size() < graph_.size()) {
      reach.resize(graph_.size(), 0.0);
      done.resize(graph_.size(), 0);
    }
    for (const NoisyBeliefGraph::Branch& branch : branches) {
      branches_.push_back({branch.belief, branch.probability});
      reach[branch.belief] += mass * branch.probability;
      if (done[branch.belief] == 0) queue.emplace(reach[branch.belief], branch.belief);
    }
    order_.push_back(step);
    if (move_.size() < graph_.size()) move_.resize(graph_.size(), kEnd);
    move_[b] = move;
  }
  Settle(stop);
}

std::size_t ConfirmedPolicy::bytes() const {
  return sure_.bytes() + greedy_.bytes() + value_.capacity() * sizeof(double) + move_.capacity() * sizeof(GuardedMove) +
         order_.capacity() * sizeof(Step) + branches_.capacity() * sizeof(NoisyBeliefGraph::Successor);
}

/// From above: each value is the cost of a policy at all times, ending where that is cheaper.
void ConfirmedPolicy::Settle(const Stop& stop) {
  constexpr int kSweeps = 1000;
  constexpr double kSettled = 1e-12;
  move_.resize(std::max(move_.size(), graph_.size()), kEnd);
  value_.assign(graph_.size(), -1.0);
  for (const Step& step : order_) value_[step.belief] = graph_.EndCost(step.belief);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double change = 0.0;
    for (auto step = order_.rbegin(); step != order_.rend(); ++step) {
      double cost = step->cost;
      double leaves = 0.0;
      for (std::size_t i = step->first; i < step->first + step->count; ++i) {
        if (branches_[i].belief == step->belief) continue;
        cost += branches_[i].share * Value(branches_[i].belief);
        leaves += branches_[i].share;
      }
      double& value = value_[step->belief];
      if (leaves <= 0.0 || cost / leaves >= value) continue;
      change = std::max(change, value - cost / leaves);
      value = cost / leaves;
    }
    if (change <= kSettled * graph_.noisy().WrongCost() || stop(expansions())) break;
  }
  for (const Step& step : order_) {
    if (value_[step.belief] >= graph_.EndCost(step.belief)) move_[step.belief] = kEnd;
  }
}

}  // namespace feeler::planner
