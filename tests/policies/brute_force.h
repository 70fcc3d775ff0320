#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::policies {

/// Exact optimum of a small problem by dynamic programming over (subset of hypotheses, robot cell), smaller subsets
/// first; within a subset, moves that tell nothing are edges of a shortest path problem. Shares nothing with the
/// planner's solvers but `Simulate`. Up to 20 hypotheses.
class BruteForce {
 public:
  explicit BruteForce(const planner::Problem& problem) : problem_(problem) {}

  /// Optimal expected cost from the start; infinity if it cannot be localized.
  double Value() { return Solve(All())[CellIndex(problem_.start)].cost; }

  /// An optimal policy, all shifts zero; the value must be finite.
  planner::PolicyGraph MakePolicy() {
    planner::PolicyGraph policy;
    std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> made;
    policy.root = MakeNode(policy, made, All(), problem_.start);
    policy.expected_cost = policy.nodes[policy.root].expected_cost;
    policy.lower_bound = policy.expected_cost;
    return policy;
  }

 private:
  using Subset = std::uint32_t;
  struct Choice {
    double cost = std::numeric_limits<double>::infinity();
    GuardedMove move;
  };
  struct Group {
    Outcome outcome;
    Subset members = 0;
    double weight = 0.0;
  };

  Subset All() const { return (Subset{1} << problem_.hypotheses.size()) - 1; }
  std::size_t CellIndex(const Cell& r) const {
    const Cell o = r - problem_.workspace.min;
    const Cell size = problem_.workspace.Size();
    return static_cast<std::size_t>((o.x() * size.y() + o.y()) * size.z() + o.z());
  }
  Cell CellAt(std::size_t index) const {
    const Cell size = problem_.workspace.Size();
    const auto i = static_cast<int>(index);
    return problem_.workspace.min + Cell(i / (size.y() * size.z()), i / size.z() % size.y(), i % size.z());
  }
  std::vector<planner::Hypothesis> Members(Subset subset) const {
    std::vector<planner::Hypothesis> members;
    for (std::size_t i = 0; i < problem_.hypotheses.size(); ++i) {
      if (subset >> i & 1) members.push_back(problem_.hypotheses[i]);
    }
    return members;
  }
  bool Free(const Cell& r, Subset subset) const {
    for (const planner::Hypothesis& h : Members(subset)) {
      if (planner::Blocked(problem_, r, h)) return false;
    }
    return true;
  }
  std::vector<Group> Split(const Cell& r, const GuardedMove& move, Subset subset) const {
    std::map<int, Group> groups;
    for (std::size_t i = 0; i < problem_.hypotheses.size(); ++i) {
      if (!(subset >> i & 1)) continue;
      const Outcome outcome = planner::Simulate(problem_, r, move, problem_.hypotheses[i]);
      Group& group = groups[outcome.cells];
      group.outcome = outcome;
      group.members |= Subset{1} << i;
      group.weight += problem_.hypotheses[i].weight;
    }
    std::vector<Group> list;
    for (const auto& [cells, group] : groups) list.push_back(group);
    return list;
  }
  template <typename Visit>
  void ForEachMove(const Cell& r, const Visit& visit) const {
    for (const Direction d : kDirections) {
      for (const int length : problem_.move_lengths) {
        if (problem_.workspace.Contains(r + length * UnitCell(d))) visit(GuardedMove{d, length});
      }
    }
  }

  const std::vector<Choice>& Solve(Subset subset) {
    const auto found = solved_.find(subset);
    if (found != solved_.end()) return found->second;
    const auto cells = static_cast<std::size_t>(problem_.workspace.Count());
    std::vector<Choice> best(cells);
    const bool goal = planner::IsGoal(problem_, Members(subset));
    for (std::size_t i = 0; i < cells; ++i) {
      const Cell r = CellAt(i);
      if (!Free(r, subset)) continue;
      if (goal) {
        best[i].cost = 0.0;
        continue;
      }
      ForEachMove(r, [&](const GuardedMove& move) {
        const std::vector<Group> groups = Split(r, move, subset);
        if (groups.size() < 2) return;
        double weight = 0.0, cost = 0.0;
        for (const Group& group : groups) {
          const Cell next = r + group.outcome.cells * UnitCell(move.direction);
          cost += group.weight *
                  (problem_.cost.Of(group.outcome, move.direction) + Solve(group.members)[CellIndex(next)].cost);
          weight += group.weight;
        }
        if (cost / weight < best[i].cost) best[i] = {cost / weight, move};
      });
    }
    for (bool changed = !goal; changed;) {
      changed = false;
      for (std::size_t i = 0; i < cells; ++i) {
        const Cell r = CellAt(i);
        if (!Free(r, subset)) continue;
        ForEachMove(r, [&](const GuardedMove& move) {
          const std::vector<Group> groups = Split(r, move, subset);
          if (groups.size() != 1 || groups[0].outcome.cells == 0) return;
          const Cell next = r + groups[0].outcome.cells * UnitCell(move.direction);
          const double cost = problem_.cost.Of(groups[0].outcome, move.direction) + best[CellIndex(next)].cost;
          if (cost < best[i].cost - 1e-12) best[i] = {cost, move}, changed = true;
        });
      }
    }
    return solved_[subset] = std::move(best);
  }

  std::uint32_t MakeNode(planner::PolicyGraph& policy, std::map<std::pair<Subset, std::size_t>, std::uint32_t>& made,
                         Subset subset, const Cell& r) {
    const std::pair key{subset, CellIndex(r)};
    if (const auto found = made.find(key); found != made.end()) return found->second;
    const auto index = static_cast<std::uint32_t>(policy.nodes.size());
    made[key] = index;
    policy.nodes.emplace_back();
    planner::PolicyNode node;
    if (planner::IsGoal(problem_, Members(subset))) {
      for (const planner::Hypothesis& h : Members(subset)) node.leaf.push_back({h.offset, h.orientation});
    } else {
      node.move = Solve(subset)[key.second].move;
      double weight = 0.0;
      const std::vector<Group> groups = Split(r, node.move, subset);
      for (const Group& group : groups) weight += group.weight;
      for (const Group& group : groups) {
        const Cell next = r + group.outcome.cells * UnitCell(node.move.direction);
        const std::uint32_t child = MakeNode(policy, made, group.members, next);
        node.branches.push_back({group.outcome, child, Cell::Zero(), group.weight / weight});
        node.expected_cost +=
            group.weight / weight *
            (problem_.cost.Of(group.outcome, node.move.direction) + policy.nodes[child].expected_cost);
      }
    }
    policy.nodes[index] = std::move(node);
    return index;
  }

  const planner::Problem& problem_;
  std::map<Subset, std::vector<Choice>> solved_;
};

/// A problem small enough for it: a bar with a notch in the plane, six hypotheses.
inline planner::LatticeProblemData SmallProblemData(bool weighted) {
  planner::LatticeProblemData data;
  data.name = "small";
  data.size = Cell(9, 7, 1);
  data.start = Cell(0, 6, 0);
  data.tool = {Cell(0, 0, 0)};
  data.target = {Cell(2, 1, 0), Cell(3, 1, 0), Cell(4, 1, 0), Cell(5, 1, 0), Cell(2, 2, 0), Cell(5, 2, 0)};
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 2; ++y) data.hypotheses.push_back({Cell(x, y, 0), 0, weighted ? 1.0 + x + 0.3 * y : 1.0});
  }
  data.move_lengths = {1, 2, 4};
  if (weighted) data.cost = {1.0, 0.5, 0.25};
  return data;
}

}  // namespace feeler::policies
