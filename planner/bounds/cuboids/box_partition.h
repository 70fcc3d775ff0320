#pragma once

#include <array>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/belief/bits256.h"

namespace feeler::planner {

/// Hypotheses low .. low + size - 1 (per axis).
struct HypothesisBox {
  Cell low = Cell::Zero();
  Cell size = Cell::Ones();
  bool operator==(const HypothesisBox& o) const { return low == o.low && size == o.size; }
};

/// The axes in the order in which boxes are grown.
using AxisOrder = std::array<int, 3>;
inline constexpr std::array<AxisOrder, 6> kAxisOrders = {
    {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};

/// The cells x .. x + a - 1, y .. y + b - 1 of a window.
Bits256 Rectangle(int x, int y, int a, int b);

/// Cuts a set of hypotheses (one window of x and y per height) into boxes no larger than `largest` (components of
/// 1..16): again and again the least cell that is left is grown along the axes in order, as far as it goes. Empties
/// `layers`; replaces `boxes`.
void PartitionIntoBoxes(std::vector<Bits256>& layers, const AxisOrder& order, const Cell& largest,
                        std::vector<HypothesisBox>& boxes);

}  // namespace feeler::planner
