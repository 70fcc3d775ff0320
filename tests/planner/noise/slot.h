#pragma once

#include "feeler/planner/belief/lattice_problem.h"

namespace feeler::planner {

/// A slot in a wall, its place uncertain along both axes: four hypotheses.
inline LatticeProblemData Slot() {
  LatticeProblemData data;
  data.name = "slot";
  data.size = Cell(7, 6, 1);
  data.start = Cell(1, 5, 0);
  data.tool = {Cell::Zero()};
  for (int x = 0; x <= 5; ++x) {
    data.target.emplace_back(x, 0, 0);
    if (x != 2) data.target.emplace_back(x, 1, 0);
  }
  for (int x = 0; x < 2; ++x) {
    for (int y = 0; y < 2; ++y) data.hypotheses.push_back({Cell(x, y, 0), 0, 1.0});
  }
  data.move_lengths = {1, 2, 4};
  return data;
}

}  // namespace feeler::planner
