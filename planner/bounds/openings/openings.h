#pragma once

#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/lattice.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// Where the dead ends of a map begin: steps that are free on the map and blocked on the filled one (FillDeadEnds).
struct Openings {
  std::vector<Cell> mouths;           ///< displacements from which a step leads into a dead end
  std::vector<Direction> directions;  ///< of such a step, for each
};

/// Of one orientation, in the order of the map's cells.
Openings FindOpenings(const ContactMap& open, const ContactMap& filled, int orientation);

}  // namespace feeler::planner
