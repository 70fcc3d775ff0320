#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/belief/hypothesis_sets.h"

namespace feeler::planner {

/// For each member of a set, in the order of `HypothesisSets::ForEach`: bit i is set iff the member's offset plus
/// `neighbours[i]` (same orientation) is in the set too.
void NeighbourMasks(const HypothesisSets& sets, SetId set, const std::array<Cell, 6>& neighbours,
                    std::vector<std::uint8_t>& masks);

/// Members of a window `bits` at `corner` whose neighbour at `by` is a member of the window `others` at `other_corner`.
Bits256 MembersWithNeighbour(const Bits256& bits, const Cell& corner, const Bits256& others, const Cell& other_corner,
                             const Cell& by);

}  // namespace feeler::planner
