#pragma once

#include "feeler/planner/belief/lattice_problem.h"

namespace feeler::planner {

/// A wall in the plane, two cells thick, with a slot one cell wide and deep: the least of targets to find by touch, for
/// studies and tests.
struct SlotLattice {
  Cell size{16, 10, 1};
  Cell start{1, 8, 0};
  int first = 3, last = 9;  ///< of the wall, along x
  int slot = 6;
  int low = 1;  ///< y of the lower of its two rows
};

/// Its problem with `along` places of the target along x and `across` along y, equally likely.
LatticeProblemData WallWithSlot(int along, int across, const SlotLattice& lattice = {});

}  // namespace feeler::planner
