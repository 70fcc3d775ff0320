#pragma once

#include <string>
#include <utility>

#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/belief/slot_lattice.h"

namespace feeler::planner {

/// Hypotheses of equal weight, as many along each axis as `extents` says.
inline void Spread(const Cell& extents, LatticeProblemData& data) {
  for (int x = 0; x < extents.x(); ++x) {
    for (int y = 0; y < extents.y(); ++y) {
      for (int z = 0; z < extents.z(); ++z) data.hypotheses.push_back({Cell(x, y, z), 0, 1.0});
    }
  }
  data.move_lengths = {1, 2, 4, 8, 16};
}

/// A block of height 3 on the cells 2 to 1 + `wide`, without the cells of `hole` above the lowest layer.
inline LatticeProblemData Block(std::string name, const Cell& size, const Cell& wide, const Cell& hole,
                                const Cell& extents) {
  LatticeProblemData data;
  data.name = std::move(name);
  data.size = size;
  data.start = Cell(1, 1, size.z() - 1);
  data.tool = {Cell::Zero()};
  for (int x = 2; x < 2 + wide.x(); ++x) {
    for (int y = 2; y < 2 + wide.y(); ++y) {
      for (int z = 0; z < wide.z(); ++z) {
        if (x != hole.x() || y != hole.y() || z == 0) data.target.emplace_back(x, y, z);
      }
    }
  }
  Spread(extents, data);
  return data;
}

/// A block with a hole of two cells' depth, off its middle: 27 hypotheses.
inline LatticeProblemData Pocket() { return Block("pocket", {11, 11, 9}, {5, 5, 3}, {4, 4, 0}, {3, 3, 3}); }

/// A plain block: 36 hypotheses.
inline LatticeProblemData PlainBlock() { return Block("block", {12, 11, 10}, {5, 4, 3}, {0, 0, 0}, {4, 3, 3}); }

}  // namespace feeler::planner
