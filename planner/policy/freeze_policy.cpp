#include "feeler/planner/policy/freeze_policy.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

namespace feeler::planner {
namespace {

class Freezer {
 public:
  Freezer(BeliefGraph& graph, const std::function<GuardedMove(BeliefId)>& move_of) : graph_(graph), move_of_(move_of) {}

  PolicyGraph Run() {
    const BeliefId start = graph_.Start();
    if (start == kNoBelief) {
      // The frame of the root is the problem's.
      const SetId set = graph_.sets().start();
      policy_.root = LeafNode(set, graph_.sets().start_frame());
    } else {
      policy_.root = Visit(start, graph_.sets().start_frame());
    }
    policy_.expected_cost = policy_.nodes[policy_.root].expected_cost;
    return std::move(policy_);
  }

 private:
  /// Depth first, iteratively: successors are numbered before the nodes that lead to them. `root_frame` is added to the
  /// frame of the root, so that its coordinates are the problem's.
  std::uint32_t Visit(BeliefId root, const Cell& root_frame) {
    std::vector<std::pair<BeliefId, bool>> stack = {{root, false}};
    while (!stack.empty()) {
      const auto [b, children_done] = stack.back();
      stack.pop_back();
      if (index_.contains(b)) continue;
      PolicyNode node;
      node.move = move_of_(b);
      const std::vector<BeliefOutcome> outcomes = graph_.Outcomes(b, node.move);
      if (!children_done) {
        stack.emplace_back(b, true);
        for (const BeliefOutcome& outcome : outcomes) {
          if (outcome.next != kNoBelief && !index_.contains(outcome.next)) stack.emplace_back(outcome.next, false);
        }
        continue;
      }
      const double weight = graph_.Weight(b);
      for (const BeliefOutcome& outcome : outcomes) {
        PolicyBranch branch;
        branch.outcome = outcome.outcome;
        branch.probability = outcome.weight / weight;
        branch.next = outcome.next == kNoBelief ? LeafNode(outcome.set, Cell::Zero()) : index_.at(outcome.next);
        const Cell shift = b == root ? Cell(outcome.shift + root_frame) : outcome.shift;
        branch.shift = shift;
        node.expected_cost += branch.probability * (graph_.problem().cost.Of(outcome.outcome, node.move.direction) +
                                                    policy_.nodes[branch.next].expected_cost);
        node.branches.push_back(branch);
      }
      index_[b] = static_cast<std::uint32_t>(policy_.nodes.size());
      policy_.nodes.push_back(std::move(node));
    }
    return index_.at(root);
  }

  std::uint32_t LeafNode(SetId set, const Cell& frame) {
    const auto key = std::make_tuple(set, frame.x(), frame.y(), frame.z());
    const auto known = leaves_.find(key);
    if (known != leaves_.end()) return known->second;
    PolicyNode leaf;
    graph_.sets().ForEach(set, [&](const Cell& offset, int orientation, std::uint32_t, int) {
      leaf.leaf.push_back({Cell(offset + frame), orientation});
    });
    const auto index = static_cast<std::uint32_t>(policy_.nodes.size());
    policy_.nodes.push_back(std::move(leaf));
    leaves_.emplace(key, index);
    return index;
  }

  BeliefGraph& graph_;
  const std::function<GuardedMove(BeliefId)>& move_of_;
  PolicyGraph policy_;
  std::unordered_map<BeliefId, std::uint32_t> index_;
  std::map<std::tuple<SetId, int, int, int>, std::uint32_t> leaves_;
};

}  // namespace

PolicyGraph FreezePolicy(BeliefGraph& graph, const std::function<GuardedMove(BeliefId)>& move_of) {
  return Freezer(graph, move_of).Run();
}

std::vector<char> NodesThatLeaveWorkspace(const Problem& problem, const PolicyGraph& policy) {
  std::vector<char> leaves(policy.nodes.size(), 0);
  // The cells of a node depend on how it is reached, relative to its frame; follow each distinct pair once.
  struct Place {
    std::uint32_t node;
    Cell robot;
  };
  std::set<std::tuple<std::uint32_t, int, int, int>> seen;
  std::vector<Place> open = {{policy.root, problem.start}};
  while (!open.empty()) {
    const Place place = open.back();
    open.pop_back();
    if (!seen.emplace(place.node, place.robot.x(), place.robot.y(), place.robot.z()).second) continue;
    const PolicyNode& node = policy.nodes[place.node];
    if (node.is_leaf()) continue;
    const Cell step = UnitCell(node.move.direction);
    if (!problem.workspace.Contains(place.robot + node.move.cells * step)) leaves[place.node] = 1;
    for (const PolicyBranch& branch : node.branches) {
      open.push_back({branch.next, place.robot + branch.outcome.cells * step});
    }
  }
  return leaves;
}

bool StaysInWorkspace(const Problem& problem, const PolicyGraph& policy) {
  const std::vector<char> leaves = NodesThatLeaveWorkspace(problem, policy);
  return std::ranges::none_of(leaves, [](char out) { return out != 0; });
}

}  // namespace feeler::planner
