#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "feeler/core/lattice_grid.h"
#include "feeler/core/parallelism.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/contact/active_region.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// StepFlags of every displacement, a byte each and a grid per orientation, for tables over many orientations. The grid
/// is the domain of the map and one cell beyond it, where everything repeats. Immutable.
class StepFlagsGrid {
 public:
  /// From the store, or made and kept there; its key stands for the map.
  StepFlagsGrid(const ContactMap& map, Parallelism jobs, const ArrayStore* store = nullptr);
  std::size_t bytes() const { return flags_.size() * static_cast<std::size_t>(domain_.Count()); }

  int orientations() const { return static_cast<int>(flags_.size()); }
  std::uint8_t At(const Cell& displacement, int orientation) const {
    return flags_[static_cast<std::size_t>(orientation)][GridIndex(size_, domain_.Clamp(displacement) - domain_.min)];
  }

  /// Those of all displacements of a box, x fastest, into an array of as many.
  void Copy(const CellBox& box, int orientation, std::span<std::uint8_t> flags) const;

  struct Region {
    CellBox box;  ///< beyond it the flags repeat those of its outermost layers
    /// Per axis: nothing is in the way in the outermost layer, nor beyond it.
    std::array<bool, 3> free_above{};
    std::array<bool, 3> free_below{};
  };
  /// Where something happens under an orientation.
  const Region& region(int orientation) const { return regions_[static_cast<std::size_t>(orientation)]; }
  /// Where something happens under either of two.
  static Region Union(const Region& a, const Region& b);

 private:
  Region Active(int orientation) const;
  template <class F>
  bool AllOfLayer(CellBox box, int axis, int at, F holds) const;

  CellBox domain_;
  Cell size_;
  std::vector<SharedArray<std::uint8_t>> flags_;
  std::vector<Region> regions_;
};

}  // namespace feeler::planner
