#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/lattice.h"
#include "planner/belief/hypothesis_sets.h"

namespace feeler::planner {

/// For each member of a set, in the order of `HypothesisSets::ForEach`: bit i is set iff the member's offset plus
/// `neighbours[i]` (same orientation) is in the set too.
void NeighbourMasks(const HypothesisSets& sets, SetId set, const std::array<Cell, 6>& neighbours,
                    std::vector<std::uint8_t>& masks);

}  // namespace feeler::planner
