#include "feeler/planner/bounds/cuboids/box_partition.h"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace feeler::planner {
namespace {

constexpr int kWindow = 16;

/// Rows below `y`.
Bits256 RowsBelow(int y) {
  Bits256 bits;
  for (int w = 0; w < 4; ++w) {
    const int rows = std::clamp(y - 4 * w, 0, 4);
    bits.word[static_cast<std::size_t>(w)] = rows == 4 ? ~std::uint64_t{0} : (std::uint64_t{1} << 16 * rows) - 1;
  }
  return bits;
}

const std::array<Bits256, kWindow + 1>& AllRowsBelow() {
  static const auto kRows = [] {
    std::array<Bits256, kWindow + 1> rows;
    for (int y = 0; y <= kWindow; ++y) rows[static_cast<std::size_t>(y)] = RowsBelow(y);
    return rows;
  }();
  return kRows;
}

bool Holds(const std::vector<Bits256>& layers, int first, int count, const Bits256& bits) {
  for (int z = first; z < first + count; ++z) {
    if (bits.Without(layers[static_cast<std::size_t>(z)]).Any()) return false;
  }
  return true;
}

/// The slice that would be added to the box by growing it along an axis is in the set.
bool CanGrow(const std::vector<Bits256>& layers, const HypothesisBox& box, int axis) {
  const Cell& low = box.low;
  const Cell& size = box.size;
  const int next = low[axis] + size[axis];
  if (axis == 0) {
    return next < kWindow && Holds(layers, low.z(), size.z(), Rectangle(next, low.y(), 1, size.y()));
  }
  if (axis == 1) {
    return next < kWindow && Holds(layers, low.z(), size.z(), Rectangle(low.x(), next, size.x(), 1));
  }
  return next < static_cast<int>(layers.size()) &&
         Holds(layers, next, 1, Rectangle(low.x(), low.y(), size.x(), size.y()));
}

}  // namespace

Bits256 Rectangle(int x, int y, int a, int b) {
  const std::uint64_t row = ((std::uint64_t{1} << a) - 1) << x;
  const std::uint64_t rows = row * 0x0001000100010001;
  const auto& below = AllRowsBelow();
  return Bits256{{rows, rows, rows, rows}} &
         below[static_cast<std::size_t>(y + b)].Without(below[static_cast<std::size_t>(y)]);
}

void PartitionIntoBoxes(std::vector<Bits256>& layers, const AxisOrder& order, const Cell& largest,
                        std::vector<HypothesisBox>& boxes) {
  boxes.clear();
  for (int z = 0; z < static_cast<int>(layers.size()); ++z) {
    Bits256& layer = layers[static_cast<std::size_t>(z)];
    while (layer.Any()) {
      int bit = 0;
      while (layer.word[static_cast<std::size_t>(bit >> 6)] == 0) bit += 64;
      bit += std::countr_zero(layer.word[static_cast<std::size_t>(bit >> 6)]);
      HypothesisBox box{{bit & 15, bit >> 4, z}, Cell::Ones()};
      for (const int axis : order) {
        while (box.size[axis] < largest[axis] && CanGrow(layers, box, axis)) ++box.size[axis];
      }
      const Bits256 bits = Rectangle(box.low.x(), box.low.y(), box.size.x(), box.size.y());
      for (int k = z; k < z + box.size.z(); ++k) {
        layers[static_cast<std::size_t>(k)] = layers[static_cast<std::size_t>(k)].Without(bits);
      }
      boxes.push_back(box);
    }
  }
}

}  // namespace feeler::planner
