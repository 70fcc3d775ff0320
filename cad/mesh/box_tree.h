#pragma once

#include <array>
#include <cstddef>
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

 private:
  int Build(const std::vector<Box>& boxes, int first, int count);

  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace feeler::cad
