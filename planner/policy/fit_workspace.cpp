#include "feeler/planner/policy/fit_workspace.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "feeler/planner/policy/freeze_policy.h"

namespace feeler::planner {
namespace {

double CostToGo(const PolicyGraph& policy, const PolicyNode& node, const CostWeights& cost) {
  double expected = 0.0;
  for (const PolicyBranch& branch : node.branches) {
    expected +=
        branch.probability * (cost.Of(branch.outcome, node.move.direction) + policy.nodes[branch.next].expected_cost);
  }
  return expected;
}

/// Listed lengths that add up to `cells`, longest first.
std::vector<int> Pieces(const std::vector<int>& lengths, int cells) {
  std::vector<int> pieces;
  while (cells > 0) {
    const int piece = *std::prev(std::upper_bound(lengths.begin(), lengths.end(), cells));
    pieces.push_back(piece);
    cells -= piece;
  }
  return pieces;
}

/// Adds `node` to `policy` in pieces; the last ones first, since nodes stand after those they lead to.
std::uint32_t AddInPieces(const Problem& problem, const PolicyNode& node, PolicyGraph& policy) {
  int furthest = 0;
  for (const PolicyBranch& branch : node.branches) furthest = std::max(furthest, branch.outcome.cells);
  const std::vector<int> pieces = Pieces(problem.move_lengths, furthest + 1);
  int end = furthest + 1;
  std::uint32_t after = 0;  // where it goes on past the piece in hand
  Cell after_shift = Cell::Zero();
  double left = 0.0;  // probability of getting past the piece in hand
  for (auto piece = pieces.rbegin(); piece != pieces.rend(); ++piece) {
    const int begin = end - *piece;
    PolicyNode part;
    part.move = {node.move.direction, *piece};
    double total = left;
    for (const PolicyBranch& branch : node.branches) {
      if (branch.outcome.cells < begin || branch.outcome.cells >= end) continue;
      part.branches.push_back(branch);
      part.branches.back().outcome.cells -= begin;
      total += branch.probability;
    }
    const PolicyBranch* const only = part.branches.size() == 1 && left == 0.0 ? part.branches.data() : nullptr;
    if (only != nullptr && only->outcome.cells == 0 && std::next(piece) != pieces.rend()) {
      // All who are left touch at once: the piece would tell nothing.
      after = only->next;
      after_shift = only->shift;
      left = total;
      end = begin;
      continue;
    }
    if (left > 0.0) part.branches.push_back({{*piece, false}, after, after_shift, left});
    for (PolicyBranch& branch : part.branches) branch.probability /= total;
    left = total;
    end = begin;
    part.expected_cost = CostToGo(policy, part, problem.cost);
    after = static_cast<std::uint32_t>(policy.nodes.size());
    after_shift = Cell::Zero();
    policy.nodes.push_back(std::move(part));
  }
  return after;
}

}  // namespace

std::optional<PolicyGraph> FitIntoWorkspace(const Problem& problem, const PolicyGraph& policy) {
  const std::vector<char> leaves_workspace = NodesThatLeaveWorkspace(problem, policy);
  PolicyGraph fitted;
  std::vector<std::uint32_t> place(policy.nodes.size(), 0);
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    PolicyNode node = policy.nodes[i];
    for (PolicyBranch& branch : node.branches) {
      if (branch.next >= i) return std::nullopt;  // not one of FreezePolicy
      branch.next = place[branch.next];
    }
    if (leaves_workspace[i] != 0) {
      for (const PolicyBranch& branch : node.branches) {
        if (!branch.outcome.contact) return std::nullopt;  // the tool itself leaves
      }
      place[i] = AddInPieces(problem, node, fitted);
      continue;
    }
    if (!node.is_leaf()) node.expected_cost = CostToGo(fitted, node, problem.cost);
    place[i] = static_cast<std::uint32_t>(fitted.nodes.size());
    fitted.nodes.push_back(std::move(node));
  }
  fitted.root = place[policy.root];
  fitted.expected_cost = fitted.nodes[fitted.root].expected_cost;
  fitted.lower_bound = policy.lower_bound;
  if (!StaysInWorkspace(problem, fitted)) return std::nullopt;
  return fitted;
}

}  // namespace feeler::planner
