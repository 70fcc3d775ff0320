#pragma once

#include <cstdint>
#include <vector>

#include "feeler/core/lattice.h"

namespace feeler::planner {

/// A frozen policy: an acyclic graph from a start belief to its leaves, in canonical coordinates. Because contact
/// depends on r - h alone, beliefs that are translates of each other share a node: a node stands for a belief whose
/// hypotheses have been shifted by some offset, and each branch says by how much its successor is shifted further.
/// Walking the graph from the root with shift 0 and adding the shift of each branch taken, hypothesis `leaf` of a leaf
/// node is `leaf offset + accumulated shift` in the coordinates of the problem. Solvers without canonical translation
/// leave all shifts zero.
struct PolicyBranch {
  Outcome outcome;
  std::uint32_t next = 0;     ///< node index
  Cell shift = Cell::Zero();  ///< offset of the successor's canonical frame in this node's frame
  double probability = 0.0;   ///< given the belief of this node
};

struct PolicyLeaf {
  Cell offset = Cell::Zero();  ///< in the frame of the node
  int orientation = 0;
};

struct PolicyNode {
  GuardedMove move;                    ///< unused at a leaf
  std::vector<PolicyBranch> branches;  ///< distinct outcomes; empty exactly at a leaf
  std::vector<PolicyLeaf> leaf;        ///< hypotheses left at a leaf; one under goal `singleton`
  double expected_cost = 0.0;          ///< exact cost to go
  bool is_leaf() const { return branches.empty(); }
};

struct PolicyGraph {
  std::vector<PolicyNode> nodes;
  std::uint32_t root = 0;
  double expected_cost = 0.0;  ///< exact, over every hypothesis of the start belief
  double lower_bound = 0.0;    ///< proven, never inflated
};

}  // namespace feeler::planner
