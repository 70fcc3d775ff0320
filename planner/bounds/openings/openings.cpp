#include "feeler/planner/bounds/openings/openings.h"

#include <algorithm>

#include "feeler/core/lattice_grid.h"

namespace feeler::planner {

Openings FindOpenings(const ContactMap& open, const ContactMap& filled, int orientation) {
  Openings openings;
  ForEachCell(open.domain(), [&](const Cell& here) {
    if (filled.Blocked(here, orientation)) return;
    const auto* const into = std::ranges::find_if(kDirections, [&](Direction d) {
      return open.StepFree(here, d, orientation) && !filled.StepFree(here, d, orientation);
    });
    if (into == kDirections.end()) return;
    openings.mouths.push_back(here);
    openings.directions.push_back(*into);
  });
  return openings;
}

}  // namespace feeler::planner
