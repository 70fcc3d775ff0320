#pragma once

#include "feeler/planner/belief/slot_lattice.h"

namespace feeler::planner {

/// A slot in a wall, its place uncertain along both axes: four hypotheses.
inline LatticeProblemData Slot() {
  LatticeProblemData data =
      WallWithSlot(2, 2, {.size = {7, 6, 1}, .start = {1, 5, 0}, .first = 0, .last = 5, .slot = 2, .low = 0});
  data.move_lengths = {1, 2, 4};
  return data;
}

}  // namespace feeler::planner
