#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "feeler/core/lattice.h"
#include "feeler/core/lattice_grid.h"
#include "feeler/planner/contact/active_region.h"

namespace feeler::planner {

/// The displacements for which a table over boxes of hypotheses keeps values. Beyond the part of a map where something
/// happens all repeats, so that a place outside counts as the nearest one inside; where nothing is in the way out there
/// the way back comes on top. Along axes in which the map is its own mirror image only the lower half is kept.
struct BoxGrid {
  explicit BoxGrid(const ActiveRegion& region)
      : active{region.box.min - Cell::Ones(), region.box.max + Cell::Ones()},
        mirrored(region.mirrored),
        free_above(region.free_above),
        free_below(region.free_below) {}

  /// Of the plane of one box.
  struct Shape {
    Cell whole = Cell::Zero();   ///< cells of the grid
    Cell stored = Cell::Zero();  ///< of them up to the middle along mirrored axes
    std::size_t Cells() const { return static_cast<std::size_t>(stored.cast<std::int64_t>().prod()); }
  };
  /// For a box of `size` hypotheses; displacements are those from its least one, from active.min on.
  Shape ShapeOf(const Cell& size) const {
    Shape shape;
    shape.whole = active.Size() + size - Cell::Ones();
    shape.stored = shape.whole;
    for (int axis = 0; axis < 3; ++axis) {
      if (mirrored[static_cast<std::size_t>(axis)]) shape.stored[axis] = (shape.whole[axis] + 1) / 2;
    }
    return shape;
  }

  struct Place {
    std::size_t index = 0;  ///< into an array over `stored`
    int beyond = 0;         ///< cells of way back
  };
  Place PlaceOf(const Shape& shape, const Cell& displacement) const {
    Place place;
    Cell cell = displacement - active.min;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      if (cell[axis] < 0) {
        if (free_below[i]) place.beyond -= cell[axis];
        cell[axis] = 0;
      } else if (cell[axis] >= shape.whole[axis]) {
        if (free_above[i]) place.beyond += cell[axis] - shape.whole[axis] + 1;
        cell[axis] = shape.whole[axis] - 1;
      }
      if (cell[axis] >= shape.stored[axis]) cell[axis] = shape.whole[axis] - 1 - cell[axis];
    }
    place.index = GridIndex(shape.stored, cell);
    return place;
  }

  CellBox active;  ///< displacements of one hypothesis beyond which the map repeats, and one cell more
  std::array<bool, 3> mirrored;
  /// Per axis: nothing is blocked beyond the active box, above and below. Who starts there has to come back.
  std::array<bool, 3> free_above;
  std::array<bool, 3> free_below;
};

}  // namespace feeler::planner
