#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// A tree over things that have boxes, halved by the middles of those along the widest axis. Immutable; shared by
/// threads.
class BoxTree {
 public:
  struct Node {
    Box box;
    int first = 0;  ///< of its things in order(), for a leaf; else the number of its first child
    int count = 0;  ///< 0: an inner node
    int second = 0;
  };

  explicit BoxTree(const std::vector<Box>& boxes);

  bool empty() const { return nodes_.empty(); }
  const std::vector<Node>& nodes() const { return nodes_; }  ///< the root is the first
  const std::vector<int>& order() const { return order_; }   ///< numbers of the things, those of a leaf together

  /// Calls `visit` with the number of each thing in the leaves whose boxes, and those around them, `meets` accepts,
  /// until it returns false.
  template <class Meets, class Visit>
  void Descend(const Meets& meets, const Visit& visit) const {
    std::array<int, 64> stack{};  // the tree halves: it is less than 32 deep
    std::size_t waiting = 0;
    if (!nodes_.empty()) stack[waiting++] = 0;
    while (waiting > 0) {
      const Node& node = nodes_[static_cast<std::size_t>(stack[--waiting])];
      if (!meets(node.box)) continue;
      if (node.count == 0) {
        stack[waiting++] = node.second;
        stack[waiting++] = node.first;
        continue;
      }
      for (int i = node.first; i < node.first + node.count; ++i) {
        if (!visit(order_[static_cast<std::size_t>(i)])) return;
      }
    }
  }

  /// The same where what is true of a box is so of those within: `narrow(box, state)` gives what is left of the state
  /// of the box around, or nothing where the box is not to be looked into; `visit` gets that of the leaf, too.
  template <class State, class Narrow, class Visit>
  void DescendWith(const State& state, const Narrow& narrow, const Visit& visit) const {
    if (!nodes_.empty()) DescendWith(nodes_.front(), state, narrow, visit);
  }

 private:
  template <class State, class Narrow, class Visit>
  bool DescendWith(const Node& node, const State& around, const Narrow& narrow, const Visit& visit) const {
    const std::optional<State> state = narrow(node.box, around);
    if (!state) return true;
    if (node.count == 0) {
      return DescendWith(nodes_[static_cast<std::size_t>(node.first)], *state, narrow, visit) &&
             DescendWith(nodes_[static_cast<std::size_t>(node.second)], *state, narrow, visit);
    }
    for (int i = node.first; i < node.first + node.count; ++i) {
      if (!visit(order_[static_cast<std::size_t>(i)], *state)) return false;
    }
    return true;
  }

  int Build(const std::vector<Box>& boxes, int first, int count);

  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace feeler::cad
