#include "feeler/cad/mesh/box_tree.h"

#include <algorithm>
#include <numeric>

namespace feeler::cad {
namespace {

constexpr int kLeafSize = 6;

}  // namespace

BoxTree::BoxTree(const std::vector<Box>& boxes) : order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.reserve(order_.size());
  if (!order_.empty()) Build(boxes, 0, static_cast<int>(order_.size()));
}

int BoxTree::Build(const std::vector<Box>& boxes, int first, int count) {
  const int number = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  Box box;
  Box centers;
  for (int i = first; i < first + count; ++i) {
    const Box& one = boxes[static_cast<std::size_t>(order_[static_cast<std::size_t>(i)])];
    box.extend(one);
    centers.extend(one.center());
  }
  Node node{box, first, count, 0};
  if (count > kLeafSize) {
    int axis = 0;
    centers.sizes().maxCoeff(&axis);
    const auto begin = order_.begin() + first;
    const int half = count / 2;
    const auto middle = [&](int i) {
      const Box& one = boxes[static_cast<std::size_t>(i)];
      return (one.min()[axis] + one.max()[axis]) / 2;
    };
    std::nth_element(begin, begin + half, begin + count, [&](int a, int b) {
      const double x = middle(a);
      const double y = middle(b);
      return x != y ? x < y : a < b;
    });
    node.count = 0;
    node.first = Build(boxes, first, half);
    node.second = Build(boxes, first + half, count - half);
  }
  nodes_[static_cast<std::size_t>(number)] = node;
  return number;
}

}  // namespace feeler::cad
