#pragma once

#include <algorithm>
#include <bit>
#include <string>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::policies {

/// A lawful policy of about `nodes` nodes with random moves, shared nodes, shifts and costs, in random node order. With
/// `uniform` the probabilities are those of a uniform prior, else arbitrary.
inline planner::PolicyGraph RandomPolicy(RandomStream& random, std::size_t nodes, bool uniform) {
  const auto cell = [&](int range) {
    const auto draw = [&] { return static_cast<int>(random.Index(static_cast<std::uint64_t>(2 * range + 1))) - range; };
    const int x = draw(), y = draw(), z = draw();
    return Cell(x, y, z);
  };
  std::vector<planner::PolicyNode> built;
  std::vector<double> counts;
  const std::size_t leaves = 1 + nodes / 3;
  for (std::size_t i = 0; i < nodes; ++i) {
    planner::PolicyNode node;
    if (i < leaves) {
      const std::size_t left = 1 + random.Index(i % 5 == 0 ? 3 : 1);
      for (std::size_t k = 0; k < left; ++k) {
        node.leaf.push_back({cell(4) + Cell(10 * static_cast<int>(k), 0, 0), static_cast<int>(random.Index(3))});
      }
      counts.push_back(static_cast<double>(left));
      built.push_back(node);
      continue;
    }
    const int length = 1 << random.Index(5);
    node.move = {kDirections[random.Index(kDirectionCount)], length};
    std::vector<int> travelled(static_cast<std::size_t>(length) + 1);
    for (int k = 0; k <= length; ++k) travelled[static_cast<std::size_t>(k)] = k;
    for (std::size_t k = travelled.size(); k > 1; --k) std::swap(travelled[k - 1], travelled[random.Index(k)]);
    const std::size_t branches = 1 + random.Index(std::min<std::size_t>(4, travelled.size()));
    double total = 0.0;
    std::vector<double> weights;
    for (std::size_t k = 0; k < branches; ++k) {
      planner::PolicyBranch branch;
      branch.outcome = {travelled[k], travelled[k] < length};
      branch.next = static_cast<std::uint32_t>(random.Index(i));
      if (random.Index(3) == 0) branch.shift = cell(3);
      weights.push_back(uniform ? counts[branch.next] : random.Uniform(0.1, 1.0));
      total += weights.back();
      node.branches.push_back(branch);
    }
    for (std::size_t k = 0; k < branches; ++k) {
      planner::PolicyBranch& branch = node.branches[k];
      branch.probability = weights[k] / total;
      node.expected_cost += branch.probability * (branch.outcome.cells + built[branch.next].expected_cost);
    }
    double count = 0.0;
    for (const planner::PolicyBranch& branch : node.branches) count += counts[branch.next];
    counts.push_back(std::min(count, 1e6));
    built.push_back(node);
  }
  std::vector<std::uint32_t> place(nodes);
  for (std::uint32_t i = 0; i < nodes; ++i) place[i] = i;
  for (std::size_t k = nodes; k > 1; --k) std::swap(place[k - 1], place[random.Index(k)]);
  planner::PolicyGraph policy;
  policy.nodes.resize(nodes);
  for (std::size_t i = 0; i < nodes; ++i) {
    for (planner::PolicyBranch& branch : built[i].branches) branch.next = place[branch.next];
    policy.nodes[place[i]] = built[i];
  }
  policy.root = place[nodes - 1];
  policy.expected_cost = policy.nodes[policy.root].expected_cost;
  policy.lower_bound = policy.expected_cost * random.Uniform();
  return policy;
}

inline bool SameBits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

/// Equal in every field, doubles bit for bit.
inline bool Identical(const planner::PolicyGraph& a, const planner::PolicyGraph& b) {
  if (a.root != b.root || a.nodes.size() != b.nodes.size()) return false;
  if (!SameBits(a.expected_cost, b.expected_cost) || !SameBits(a.lower_bound, b.lower_bound)) return false;
  for (std::size_t i = 0; i < a.nodes.size(); ++i) {
    const planner::PolicyNode &m = a.nodes[i], &n = b.nodes[i];
    if (!(m.move == n.move) || !SameBits(m.expected_cost, n.expected_cost)) return false;
    if (m.branches.size() != n.branches.size() || m.leaf.size() != n.leaf.size()) return false;
    for (std::size_t k = 0; k < m.branches.size(); ++k) {
      const planner::PolicyBranch &s = m.branches[k], &t = n.branches[k];
      if (!(s.outcome == t.outcome) || s.next != t.next || s.shift != t.shift) return false;
      if (!SameBits(s.probability, t.probability)) return false;
    }
    for (std::size_t k = 0; k < m.leaf.size(); ++k) {
      if (m.leaf[k].offset != n.leaf[k].offset || m.leaf[k].orientation != n.leaf[k].orientation) return false;
    }
  }
  return true;
}

/// One of many small changes to a byte string: flips, insertions, deletions, doubled or cut pieces.
inline std::string Mutate(std::string bytes, RandomStream& random) {
  const std::uint64_t changes = 1 + random.Index(4);
  for (std::uint64_t k = 0; k < changes && !bytes.empty(); ++k) {
    const std::size_t at = random.Index(bytes.size());
    const std::size_t length = 1 + random.Index(std::min<std::size_t>(bytes.size() - at, 16));
    switch (random.Index(6)) {
      case 0: bytes[at] = static_cast<char>(bytes[at] ^ (1 << random.Index(8))); break;
      case 1: bytes[at] = static_cast<char>(random.Index(256)); break;
      case 2: bytes.erase(at, length); break;
      case 3: bytes.insert(at, bytes.substr(at, length)); break;
      case 4: bytes.insert(at, 1, "0123456789-.eE[]{},:\"n"[random.Index(22)]); break;
      default: bytes.resize(at); break;
    }
  }
  return bytes;
}

}  // namespace feeler::policies
