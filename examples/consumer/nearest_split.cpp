#include "nearest_split.h"

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/error.h"

using namespace feeler;
using planner::Hypothesis;

namespace {

using Key = std::tuple<int, int, int>;
/// Hypotheses by the outcome they would give.
using Split = std::map<std::pair<int, bool>, std::vector<Hypothesis>>;

Key KeyOf(const Cell& cell) { return {cell.x(), cell.y(), cell.z()}; }

class NearestSplit {
 public:
  explicit NearestSplit(const planner::Problem& problem) : problem_(problem) {}

  planner::PolicyGraph Solve() {
    graph_.root = Node(problem_.start, problem_.hypotheses);
    graph_.expected_cost = graph_.nodes[graph_.root].expected_cost;
    return graph_;
  }

 private:
  /// The node for a belief; its cost is exact.
  std::uint32_t Node(const Cell& robot, const std::vector<Hypothesis>& hypotheses) {
    planner::PolicyNode node;
    if (hypotheses.size() == 1) {
      node.leaf.push_back({hypotheses.front().offset, hypotheses.front().orientation});
    } else {
      node.move = WayToSplit(robot, hypotheses);
      double weight = 0.0;
      for (const Hypothesis& h : hypotheses) weight += h.weight;
      for (const auto& [answer, left] : Answers(robot, node.move, hypotheses)) {
        planner::PolicyBranch branch;
        branch.outcome.cells = answer.first;
        branch.outcome.contact = answer.second;
        // Summed before divided: the only answer has probability 1 exactly.
        for (const Hypothesis& h : left) branch.probability += h.weight;
        branch.probability /= weight;
        branch.next = Node(robot + answer.first * UnitCell(node.move.direction), left);
        node.expected_cost += branch.probability * (problem_.cost.Of(branch.outcome, node.move.direction) +
                                                    graph_.nodes[branch.next].expected_cost);
        node.branches.push_back(branch);
      }
    }
    graph_.nodes.push_back(node);
    return static_cast<std::uint32_t>(graph_.nodes.size() - 1);
  }

  Split Answers(const Cell& robot, const GuardedMove& move, const std::vector<Hypothesis>& hypotheses) const {
    Split split;
    for (const Hypothesis& h : hypotheses) {
      const Outcome outcome = planner::Simulate(problem_, robot, move, h);
      split[{outcome.cells, outcome.contact}].push_back(h);
    }
    return split;
  }

  /// Breadth first over cells; the first move of the way.
  GuardedMove WayToSplit(const Cell& robot, const std::vector<Hypothesis>& hypotheses) const {
    std::deque<std::pair<Cell, std::optional<GuardedMove>>> open = {{robot, std::nullopt}};
    std::set<Key> seen = {KeyOf(robot)};
    while (!open.empty()) {
      const auto [cell, first] = open.front();
      open.pop_front();
      for (const Direction direction : kDirections) {
        for (const int length : problem_.move_lengths) {
          const GuardedMove move{direction, length};
          if (!problem_.workspace.Contains(cell + length * UnitCell(direction))) continue;
          const Split split = Answers(cell, move, hypotheses);
          if (split.size() > 1) return first.value_or(move);
          const Cell next = cell + split.begin()->first.first * UnitCell(direction);
          if (seen.insert(KeyOf(next)).second) open.emplace_back(next, first.value_or(move));
        }
      }
    }
    throw NegativeResult(problem_.name, "no move tells the hypotheses left apart");
  }

  const planner::Problem& problem_;
  planner::PolicyGraph graph_;
};

}  // namespace

planner::PolicyGraph SolveByNearestSplit(const planner::Problem& problem) { return NearestSplit(problem).Solve(); }
