#include "feeler/planner/belief/neighbour_masks.h"

#include <algorithm>
#include <cstdlib>
#include <tuple>

namespace feeler::planner {
namespace {

/// Members of the window whose neighbour `by` (a non-zero offset in the window's plane) is in `bits` too.
Bits256 WithNeighbourInWindow(const Bits256& bits, const Cell& by) {
  if (std::abs(by.x()) > 15 || std::abs(by.y()) > 15) return {};
  // The columns of the window in which x + by.x stays inside.
  const std::uint64_t row = by.x() >= 0 ? 0xFFFFU >> by.x() : 0xFFFFU << -by.x() & 0xFFFFU;
  const std::uint64_t rows = row * 0x0001000100010001;
  const Bits256 columns{{rows, rows, rows, rows}};
  const int down = by.x() + 16 * by.y();
  return bits & columns & (down >= 0 ? bits.Down(down) : bits.Up(-down));
}

}  // namespace

Bits256 MembersWithNeighbour(const Bits256& bits, const Cell& corner, const Bits256& others, const Cell& other_corner,
                             const Cell& by) {
  const Cell moved = corner + by - other_corner;  // where the window's corner lies in the other window
  if (moved.z() != 0 || std::abs(moved.x()) > 15 || std::abs(moved.y()) > 15) return {};
  const std::uint64_t row = moved.x() >= 0 ? 0xFFFFU >> moved.x() : 0xFFFFU << -moved.x() & 0xFFFFU;
  const std::uint64_t rows = row * 0x0001000100010001;
  const Bits256 columns{{rows, rows, rows, rows}};
  const int down = moved.x() + 16 * moved.y();
  return bits & columns & (down >= 0 ? others.Down(down) : others.Up(-down));
}

void NeighbourMasks(const HypothesisSets& sets, SetId set, const std::array<Cell, 6>& neighbours,
                    std::vector<std::uint8_t>& masks) {
  masks.clear();
  const auto slabs = sets.slabs(set);
  if (sets.single_window()) {
    for (const Slab& slab : slabs) {
      std::array<Bits256, 6> with;
      for (std::size_t i = 0; i < neighbours.size(); ++i) {
        const Cell& by = neighbours[i];
        if (by.z() == 0) {
          with[i] = WithNeighbourInWindow(slab.bits, by);
        } else {
          for (const Slab& other : slabs) {
            if (sets.Orientation(other.layer) == sets.Orientation(slab.layer) &&
                sets.Corner(other.layer).z() == sets.Corner(slab.layer).z() + by.z()) {
              with[i] = slab.bits & other.bits;
            }
          }
        }
      }
      slab.bits.ForEach([&](int bit) {
        unsigned mask = 0;
        for (std::size_t i = 0; i < with.size(); ++i) mask |= (with[i].Test(bit) ? 1U : 0U) << i;
        masks.push_back(static_cast<std::uint8_t>(mask));
      });
    }
    return;
  }
  using Key = std::tuple<int, int, int, int>;
  std::vector<Key> members;
  sets.ForEach(set, [&](const Cell& h, int o, std::uint32_t, int) { members.emplace_back(o, h.x(), h.y(), h.z()); });
  std::vector<Key> sorted = members;
  std::ranges::sort(sorted);
  for (const auto& [o, x, y, z] : members) {
    unsigned mask = 0;
    for (std::size_t i = 0; i < neighbours.size(); ++i) {
      const Cell& by = neighbours[i];
      const bool in = std::ranges::binary_search(sorted, Key(o, x + by.x(), y + by.y(), z + by.z()));
      mask |= (in ? 1U : 0U) << i;
    }
    masks.push_back(static_cast<std::uint8_t>(mask));
  }
}

}  // namespace feeler::planner
