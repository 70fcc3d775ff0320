#include "feeler/planner/belief/slot_lattice.h"

namespace feeler::planner {

LatticeProblemData WallWithSlot(int along, int across, const SlotLattice& lattice) {
  LatticeProblemData data;
  data.name = "slot";
  data.size = lattice.size;
  data.start = lattice.start;
  data.tool = {Cell::Zero()};
  for (int x = lattice.first; x <= lattice.last; ++x) {
    data.target.emplace_back(x, lattice.low, 0);
    if (x != lattice.slot) data.target.emplace_back(x, lattice.low + 1, 0);
  }
  for (int x = 0; x < along; ++x) {
    for (int y = 0; y < across; ++y) data.hypotheses.push_back({Cell(x, y, 0), 0, 1.0});
  }
  return data;
}

}  // namespace feeler::planner
