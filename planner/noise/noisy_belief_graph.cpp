#include "feeler/planner/noise/noisy_belief_graph.h"

#include <algorithm>
#include <cmath>

namespace feeler::planner {
namespace {

/// Beliefs are one where no probability differs by more.
constexpr double kSame = 1e-9;
/// Less likely hypotheses are taken to be impossible.
constexpr double kImpossible = 1e-9;
/// Less likely outcomes are not followed: they are paid for as given up.
constexpr double kNotFollowed = 1e-15;
/// Probabilities that agree after rounding to this share a key (rounded apart: then a belief is stored twice).
constexpr double kKeyGrain = 1e-7;

std::uint64_t Mix(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9E3779B97F4A7C15;
  return hash ^ hash >> 29;
}

std::uint64_t HashOf(const Cell& robot, std::span<const WeightedHypothesis> belief) {
  std::uint64_t hash = 0xCBF29CE484222325;
  for (int axis = 0; axis < 3; ++axis) hash = Mix(hash, static_cast<std::uint32_t>(robot[axis]));
  for (const WeightedHypothesis& h : belief) {
    hash = Mix(hash, h.hypothesis);
    hash = Mix(hash, static_cast<std::uint64_t>(std::llround(h.weight / kKeyGrain)));
  }
  return hash;
}

}  // namespace

NoisyBeliefGraph::NoisyBeliefGraph(const NoisyProblem& noisy, Bound bound)
    : noisy_(noisy),
      bound_(std::move(bound)),
      moves_(noisy.noise),
      goal_sets_(LargestGoalSets(noisy.problem)),
      parts_(2 * static_cast<std::size_t>(noisy.problem.move_lengths.back()) + 2),
      dense_(noisy.problem.hypotheses.size(), 0.0) {
  std::vector<WeightedHypothesis> start;
  double total = 0.0;
  for (std::size_t h = 0; h < noisy.problem.hypotheses.size(); ++h) {
    start.push_back({static_cast<std::uint32_t>(h), noisy.problem.hypotheses[h].weight});
    total += noisy.problem.hypotheses[h].weight;
  }
  Intern(noisy.problem.start, start, total);
}

bool NoisyBeliefGraph::Same(const Node& node, const Cell& robot, std::span<const WeightedHypothesis> belief) const {
  if (node.robot != robot || node.count != belief.size()) return false;
  const WeightedHypothesis* mine = entries_.data() + node.first;
  return std::ranges::equal(belief, std::span(mine, node.count), [](const auto& a, const auto& b) {
    return a.hypothesis == b.hypothesis && std::abs(a.weight - b.weight) <= kSame;
  });
}

void NoisyBeliefGraph::SetEnd(Node& node) const {
  const std::span<const WeightedHypothesis> belief{entries_.data() + node.first, node.count};
  for (const WeightedHypothesis& h : belief) dense_[h.hypothesis] = h.weight;
  node.confidence = -1.0;
  const auto consider = [&](std::size_t set) {
    double probability = 0.0;
    for (const int h : goal_sets_[set]) probability += dense_[static_cast<std::size_t>(h)];
    if (probability <= node.confidence) return;
    node.confidence = probability;
    node.likeliest = static_cast<std::int32_t>(set);
  };
  if (noisy_.problem.goal == GoalKind::kSingleton) {
    for (const WeightedHypothesis& h : belief) consider(h.hypothesis);
  } else {
    for (std::size_t set = 0; set < goal_sets_.size(); ++set) consider(set);
  }
  for (const WeightedHypothesis& h : belief) dense_[h.hypothesis] = 0.0;
  node.sure = node.confidence >= noisy_.declaration.confidence - 1e-12;
  node.end_cost = noisy_.WrongCost() * (node.sure ? std::max(0.0, 1.0 - node.confidence) : 1.0);
}

std::uint32_t NoisyBeliefGraph::Intern(const Cell& robot, std::vector<WeightedHypothesis>& belief, double total) {
  const double least = kImpossible * total;
  std::erase_if(belief, [&](const WeightedHypothesis& h) { return h.weight < least; });
  for (WeightedHypothesis& h : belief) h.weight /= total;
  const std::uint64_t hash = HashOf(robot, belief);
  const auto [low, high] = index_.equal_range(hash);
  for (auto it = low; it != high; ++it) {
    if (Same(beliefs_[it->second], robot, belief)) return it->second;
  }
  const auto number = static_cast<std::uint32_t>(beliefs_.size());
  Node node;
  node.robot = robot;
  node.first = entries_.size();
  node.count = static_cast<std::uint32_t>(belief.size());
  entries_.insert(entries_.end(), belief.begin(), belief.end());
  SetEnd(node);
  node.heuristic = bound_ ? std::min(node.end_cost, bound_(robot, belief)) : 0.0;
  beliefs_.push_back(node);
  index_.emplace(hash, number);
  return number;
}

std::uint32_t NoisyBeliefGraph::Core(std::uint32_t b, double least) {
  std::vector<WeightedHypothesis> core;
  double total = 0.0;
  for (const WeightedHypothesis& h : Belief(b)) {
    if (h.weight < least) continue;
    core.push_back(h);
    total += h.weight;
  }
  if (core.empty() || core.size() == beliefs_[b].count) return b;
  return Intern(beliefs_[b].robot, core, total);
}

void NoisyBeliefGraph::LookAhead(std::uint32_t b, Direction direction, int longest) {
  room_.clear();
  const Problem& problem = noisy_.problem;
  for (const WeightedHypothesis& h : Belief(b)) {
    room_.push_back(Simulate(problem, Robot(b), {direction, longest}, problem.hypotheses[h.hypothesis]).cells);
  }
}

double NoisyBeliefGraph::Split(std::uint32_t b, const GuardedMove& move) {
  const Cell robot = Robot(b);
  double cost = 0.0;
  for (std::uint32_t i = 0; i < beliefs_[b].count; ++i) {
    const WeightedHypothesis h = entries_[beliefs_[b].first + i];
    const NoisyMove& does = moves_.Of(move.cells, room_[i]);
    cost += h.weight * does.Cost(noisy_.problem.cost, move.direction);
    for (const NoisyOutcome& o : does.outcomes) {
      const auto part = static_cast<std::size_t>(2 * o.outcome.cells + (o.outcome.contact ? 1 : 0));
      parts_[part].push_back({h.hypothesis, h.weight * o.probability});
    }
  }
  branches_.clear();
  for (int part = 0; part <= 2 * move.cells + 1; ++part) {
    std::vector<WeightedHypothesis>& belief = parts_[static_cast<std::size_t>(part)];
    if (belief.empty()) continue;
    double probability = 0.0;
    for (const WeightedHypothesis& h : belief) probability += h.weight;
    if (probability <= kNotFollowed) {
      cost += probability * noisy_.WrongCost();
    } else {
      const Outcome outcome{part / 2, part % 2 == 1};
      const std::uint32_t next = Intern(robot + outcome.cells * UnitCell(move.direction), belief, probability);
      branches_.push_back({outcome, next, probability});
    }
    belief.clear();
  }
  return cost;
}

std::vector<NoisyBeliefGraph::Branch> NoisyBeliefGraph::Branches(std::uint32_t b, const GuardedMove& move,
                                                                 double* cost) {
  LookAhead(b, move.direction, move.cells);
  const double expected = Split(b, move);
  if (cost != nullptr) *cost = expected;
  return branches_;
}

int NoisyBeliefGraph::LongestApplicable(const Cell& robot, Direction direction) const {
  const int axis = AxisOf(direction);
  const CellBox& box = noisy_.problem.workspace;
  return SignOf(direction) > 0 ? box.max[axis] - robot[axis] : robot[axis] - box.min[axis];
}

void NoisyBeliefGraph::Expand(std::uint32_t b) {
  const auto first = static_cast<std::uint32_t>(actions_.size());
  actions_.push_back({beliefs_[b].end_cost, {}, 0, 0});
  actions_.back().move.cells = 0;
  const Problem& problem = noisy_.problem;
  for (const Direction direction : kDirections) {
    const int longest = std::min(problem.move_lengths.back(), LongestApplicable(Robot(b), direction));
    if (longest < 1) continue;
    LookAhead(b, direction, longest);
    const int furthest = *std::ranges::max_element(room_);
    if (furthest == 0) continue;  // a known wall
    for (const int cells : problem.move_lengths) {
      if (cells > longest) break;
      const double cost = Split(b, {direction, cells});
      double leaves = 0.0;
      const auto begin = static_cast<std::uint32_t>(successors_.size());
      for (const Branch& branch : branches_) {
        if (branch.belief == b) continue;
        successors_.push_back({branch.belief, branch.probability});
        leaves += branch.probability;
      }
      const auto count = static_cast<std::uint32_t>(successors_.size()) - begin;
      if (count == 0) continue;
      for (std::uint32_t i = begin; i < begin + count; ++i) successors_[i].share /= leaves;
      actions_.push_back({cost / leaves, {direction, cells}, begin, count});
    }
  }
  beliefs_[b].first_action = first;
  beliefs_[b].action_count = static_cast<std::uint32_t>(actions_.size()) - first;
}

std::size_t NoisyBeliefGraph::bytes() const {
  return beliefs_.size() * (sizeof(Node) + 48) + entries_.size() * sizeof(WeightedHypothesis) +
         actions_.size() * sizeof(Action) + successors_.size() * sizeof(Successor);
}

}  // namespace feeler::planner
