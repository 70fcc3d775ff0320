#include "feeler/planner/policy/policy_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace feeler::planner {
namespace {

/// A policy of a family has at most some thousands of nodes on a path; beyond this it does not end.
constexpr std::size_t kLongestPath = 100000;

/// One visit of a policy node by the hypotheses that reach it.
struct Visit {
  std::uint32_t policy_node = 0;
  int tree_node = 0;
  Cell shift = Cell::Zero();
  std::size_t depth = 0;
};

class Replayer {
 public:
  Replayer(const Problem& problem, const PolicyGraph& policy) : problem_(problem), policy_(policy) {
    for (const Hypothesis& h : problem.hypotheses) total_weight_ += h.weight;
  }

  PolicyReplay Run() {
    if (policy_.root >= policy_.nodes.size()) {
      replay_.fault = "the root is not a node";
      return std::move(replay_);
    }
    ExpandedNode root;
    root.hypotheses.resize(problem_.hypotheses.size());
    std::iota(root.hypotheses.begin(), root.hypotheses.end(), 0);
    root.robot = problem_.start;
    replay_.tree.nodes.push_back(std::move(root));
    std::vector<Visit> open = {{policy_.root, 0, Cell::Zero(), 0}};
    while (!open.empty() && replay_.fault.empty()) {
      const Visit visit = open.back();
      open.pop_back();
      const PolicyNode& node = policy_.nodes[visit.policy_node];
      if (node.is_leaf()) {
        CheckLeaf(visit, node);
      } else {
        Branch(visit, node, open);
      }
    }
    if (replay_.fault.empty()) SumCosts();
    return std::move(replay_);
  }

 private:
  void Fault(const Visit& visit, const std::string& what) {
    if (replay_.fault.empty()) replay_.fault = fmt::format("policy node {}: {}", visit.policy_node, what);
  }

  void CheckLeaf(const Visit& visit, const PolicyNode& node) {
    const ExpandedNode& here = Here(visit);
    using Key = std::tuple<int, int, int, int>;
    std::vector<Key> listed;
    std::vector<Key> arrived;
    std::vector<Hypothesis> left;
    for (const PolicyLeaf& leaf : node.leaf) {
      const Cell c = leaf.offset + visit.shift;
      listed.emplace_back(c.x(), c.y(), c.z(), leaf.orientation);
    }
    for (const int i : here.hypotheses) {
      const Hypothesis& h = problem_.hypotheses[static_cast<std::size_t>(i)];
      arrived.emplace_back(h.offset.x(), h.offset.y(), h.offset.z(), h.orientation);
      left.push_back(h);
    }
    std::ranges::sort(listed);
    std::ranges::sort(arrived);
    if (listed != arrived) return Fault(visit, "the leaf lists other hypotheses than reach it");
    if (!IsGoal(problem_, left)) return Fault(visit, "the leaf is not a goal");
  }

  void Branch(const Visit& visit, const PolicyNode& node, std::vector<Visit>& open) {
    const ExpandedNode here = Here(visit);  // a copy: the tree grows below
    if (visit.depth > kLongestPath) return Fault(visit, "the policy has a cycle");
    if (std::ranges::find(problem_.move_lengths, node.move.cells) == problem_.move_lengths.end()) {
      return Fault(visit, fmt::format("a move of {} cells is not listed", node.move.cells));
    }
    if (!problem_.workspace.Contains(here.robot + node.move.cells * UnitCell(node.move.direction))) {
      return Fault(visit, "the move leaves the workspace");
    }
    std::map<std::pair<int, bool>, std::vector<int>> groups;
    for (const int i : here.hypotheses) {
      const Outcome outcome =
          Simulate(problem_, here.robot, node.move, problem_.hypotheses[static_cast<std::size_t>(i)]);
      groups[{outcome.cells, outcome.contact}].push_back(i);
    }
    if (groups.size() == 1 && groups.begin()->first.first == 0) return Fault(visit, "the move changes nothing");
    const double weight = Weight(here.hypotheses);
    std::vector<ExpandedBranch> outcomes;
    for (auto& [key, members] : groups) {
      const Outcome outcome{key.first, key.second};
      const auto branch = std::ranges::find(node.branches, outcome, &PolicyBranch::outcome);
      if (branch == node.branches.end()) {
        return Fault(visit,
                     fmt::format("no branch for {} cells{}", outcome.cells, outcome.contact ? " and contact" : ""));
      }
      if (branch->next >= policy_.nodes.size()) return Fault(visit, "a branch leads to no node");
      ExpandedNode next;
      const double probability = Weight(members) / weight;
      if (std::abs(probability - branch->probability) > 1e-9) return Fault(visit, "a branch has a wrong probability");
      next.hypotheses = std::move(members);
      next.robot = here.robot + outcome.cells * UnitCell(node.move.direction);
      next.probability = Weight(next.hypotheses) / total_weight_;
      const int index = static_cast<int>(replay_.tree.nodes.size());
      outcomes.push_back({outcome, index, probability});
      replay_.tree.nodes.push_back(std::move(next));
      open.push_back({branch->next, index, visit.shift + branch->shift, visit.depth + 1});
    }
    if (groups.size() != node.branches.size()) return Fault(visit, "no hypothesis takes one of the branches");
    ExpandedNode& tree_node = replay_.tree.nodes[static_cast<std::size_t>(visit.tree_node)];
    tree_node.move = node.move;
    tree_node.outcomes = std::move(outcomes);
  }

  void SumCosts() {
    std::vector<ExpandedNode>& nodes = replay_.tree.nodes;
    for (std::size_t i = nodes.size(); i-- > 0;) {
      for (const ExpandedBranch& branch : nodes[i].outcomes) {
        nodes[i].expected_cost += branch.probability * (problem_.cost.Of(branch.outcome, nodes[i].move.direction) +
                                                        nodes[static_cast<std::size_t>(branch.next)].expected_cost);
      }
    }
    replay_.tree.expected_cost = nodes.front().expected_cost;
    replay_.tree.lower_bound = policy_.lower_bound;
  }

  const ExpandedNode& Here(const Visit& visit) const {
    return replay_.tree.nodes[static_cast<std::size_t>(visit.tree_node)];
  }

  double Weight(const std::vector<int>& hypotheses) const {
    double weight = 0.0;
    for (const int i : hypotheses) weight += problem_.hypotheses[static_cast<std::size_t>(i)].weight;
    return weight;
  }

  const Problem& problem_;
  const PolicyGraph& policy_;
  double total_weight_ = 0.0;
  PolicyReplay replay_;
};

}  // namespace

PolicyReplay Replay(const Problem& problem, const PolicyGraph& policy) { return Replayer(problem, policy).Run(); }

}  // namespace feeler::planner
