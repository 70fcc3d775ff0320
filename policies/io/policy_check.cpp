#include "feeler/policies/io/policy_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <tuple>

namespace feeler::policies {
namespace {

constexpr std::uint64_t kSaturatedCount = std::uint64_t{1} << 40;

bool Finite(double value) { return std::isfinite(value) && value >= 0.0; }

bool WithinOffset(const Cell& c) { return (c.array().abs() <= kMaxPolicyOffset).all(); }

std::optional<std::string> FindLeafFault(const planner::PolicyNode& node) {
  if (node.leaf.empty()) return "has neither branches nor hypotheses";
  if (node.expected_cost != 0.0) return "is a leaf with a cost to go";
  if (IndexOf(node.move.direction) >= kDirectionCount || std::abs(node.move.cells) > kMaxMoveCells) {
    return "is a leaf with a move out of range";
  }
  std::vector<std::tuple<int, int, int, int>> seen;
  for (const planner::PolicyLeaf& leaf : node.leaf) {
    if (!WithinOffset(leaf.offset)) return "has a hypothesis out of range";
    if (leaf.orientation < 0 || leaf.orientation > kMaxPolicyOffset) return "has an orientation out of range";
    seen.emplace_back(leaf.offset.x(), leaf.offset.y(), leaf.offset.z(), leaf.orientation);
  }
  std::sort(seen.begin(), seen.end());
  if (std::adjacent_find(seen.begin(), seen.end()) != seen.end()) return "lists a hypothesis twice";
  return std::nullopt;
}

std::optional<std::string> FindBranchFault(const planner::PolicyNode& node) {
  if (!node.leaf.empty()) return "has both branches and hypotheses";
  if (IndexOf(node.move.direction) >= kDirectionCount) return "has an unknown direction";
  if (node.move.cells < 1 || node.move.cells > kMaxMoveCells) return "has a move length out of range";
  double sum = 0.0;
  std::vector<int> seen;
  for (const planner::PolicyBranch& branch : node.branches) {
    const Outcome& outcome = branch.outcome;
    if (outcome.cells < 0 || outcome.cells > node.move.cells) return "has an outcome longer than its move";
    if (outcome.contact != (outcome.cells < node.move.cells)) {
      return "has an outcome whose contact flag contradicts its distance";
    }
    if (!(branch.probability > 0.0 && branch.probability <= 1.0)) return "has a probability outside (0, 1]";
    if (!WithinOffset(branch.shift)) return "has a shift out of range";
    sum += branch.probability;
    seen.push_back(outcome.cells);
  }
  std::sort(seen.begin(), seen.end());
  if (std::adjacent_find(seen.begin(), seen.end()) != seen.end()) return "has the same outcome twice";
  if (std::abs(sum - 1.0) > 1e-9) return "has probabilities that do not sum to 1";
  return std::nullopt;
}

}  // namespace

std::optional<std::vector<std::uint32_t>> ChildrenFirst(const planner::PolicyGraph& policy) {
  enum : std::uint8_t { kNew, kOpen, kDone };
  const std::size_t count = policy.nodes.size();
  std::vector<std::uint8_t> state(count, kNew);
  std::vector<std::uint32_t> order;
  order.reserve(count);
  std::vector<std::pair<std::uint32_t, std::size_t>> stack;  // node, branches already followed
  for (std::uint32_t first = 0; first < count; ++first) {
    if (state[first] != kNew) continue;
    state[first] = kOpen;
    stack.emplace_back(first, 0);
    while (!stack.empty()) {
      auto& [node, followed] = stack.back();
      if (followed == policy.nodes[node].branches.size()) {
        state[node] = kDone;
        order.push_back(node);
        stack.pop_back();
        continue;
      }
      const std::uint32_t next = policy.nodes[node].branches[followed++].next;
      if (next >= count || state[next] == kOpen) return std::nullopt;
      if (state[next] == kNew) {
        state[next] = kOpen;
        stack.emplace_back(next, 0);
      }
    }
  }
  return order;
}

std::vector<std::uint64_t> LeafCounts(const planner::PolicyGraph& policy,
                                      const std::vector<std::uint32_t>& children_first) {
  std::vector<std::uint64_t> counts(policy.nodes.size(), 0);
  for (const std::uint32_t index : children_first) {
    const planner::PolicyNode& node = policy.nodes[index];
    std::uint64_t count = node.leaf.size();
    for (const planner::PolicyBranch& branch : node.branches) {
      count = std::min(kSaturatedCount, count + counts[branch.next]);
    }
    counts[index] = count;
  }
  return counts;
}

std::optional<std::string> FindPolicyFault(const planner::PolicyGraph& policy) {
  if (policy.nodes.empty()) return "the policy has no nodes";
  if (policy.nodes.size() > kMaxPolicyNodes) return "the policy has too many nodes";
  if (policy.root >= policy.nodes.size()) return "the root does not exist";
  if (!Finite(policy.expected_cost)) return "the expected cost is negative or not a number";
  if (!Finite(policy.lower_bound)) return "the lower bound is negative or not a number";
  const double slack = 1e-9 * std::max(1.0, policy.expected_cost);
  if (policy.lower_bound > policy.expected_cost + slack) return "the lower bound exceeds the expected cost";
  if (std::abs(policy.nodes[policy.root].expected_cost - policy.expected_cost) > slack) {
    return "the expected cost is not that of the root";
  }
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    const planner::PolicyNode& node = policy.nodes[i];
    if (!Finite(node.expected_cost)) return fmt::format("node {} has a negative cost or one that is not a number", i);
    const auto fault = node.is_leaf() ? FindLeafFault(node) : FindBranchFault(node);
    if (fault) return fmt::format("node {} {}", i, *fault);
    for (const planner::PolicyBranch& branch : node.branches) {
      if (branch.next >= policy.nodes.size()) return fmt::format("node {} leads to a node that does not exist", i);
    }
  }
  if (!ChildrenFirst(policy)) return "the policy has a cycle";
  return std::nullopt;
}

}  // namespace feeler::policies
