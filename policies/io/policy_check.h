#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "feeler/planner/policy/policy_graph.h"

namespace feeler::policies {

/// Limits that every stored policy keeps; far beyond what planners make, small enough that no arithmetic on them
/// overflows.
inline constexpr std::size_t kMaxPolicyNodes = 1U << 22;
inline constexpr int kMaxMoveCells = 1 << 20;
inline constexpr int kMaxPolicyOffset = 1 << 20;

/// The law that a policy breaks, in words, or nothing if it keeps them all:
/// - at least one node; root and successors exist; the graph has no cycle (unreachable nodes included);
/// - a node with branches has a move of 1..kMaxMoveCells cells, at least one branch, no hypotheses; outcomes are
///   distinct, cells <= move cells, contact exactly when fewer; probabilities in (0, 1] with sum 1 within 1e-9;
/// - a node without branches (a leaf) lists at least one hypothesis, none twice, and costs nothing more;
/// - costs are finite and not negative; the policy's cost is the root's within 1e-9 (relative); lower bound <= cost.
std::optional<std::string> FindPolicyFault(const planner::PolicyGraph& policy);

/// Successors before their predecessors; nothing if there is a cycle or an index out of range.
std::optional<std::vector<std::uint32_t>> ChildrenFirst(const planner::PolicyGraph& policy);

/// For each node, how many (history, hypothesis) leaves it leads to, saturated at 2^40: with a uniform prior and every
/// hypothesis on one path, the number of hypotheses of the node's belief.
std::vector<std::uint64_t> LeafCounts(const planner::PolicyGraph& policy,
                                      const std::vector<std::uint32_t>& children_first);

}  // namespace feeler::policies
