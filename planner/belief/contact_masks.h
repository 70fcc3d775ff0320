#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/lattice.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/belief/bits256.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// The contact map turned round: for the tool at one place, which of a 16 x 16 window of hypotheses block its next
/// step. Splitting a belief by a step is then a handful of word operations. Masks repeat, and so do rows of them along
/// x: each distinct one is stored once and looked up by index; index 0 is the empty mask. Immutable; safe to read from
/// many threads.
class ContactMasks {
 public:
  /// From the store, or made and kept there; its key stands for the map.
  explicit ContactMasks(const ContactMap& map, const ArrayStore* store = nullptr);

  /// Index of the mask of a window: bit x + 16 y is set iff the step in direction `d` from displacement `corner` - (x,
  /// y, 0) is blocked. `corner` is the displacement r - h of the window's corner hypothesis. Displacements that no
  /// motion can reach (inside the target) are left out of the masks.
  std::uint32_t Index(const Cell& corner, Direction d, int orientation) const {
    const Cell c = domain_.Clamp(corner) - domain_.min;
    const int plane = orientation * kDirectionCount + IndexOf(d);
    return index_[row_[static_cast<std::size_t>((plane * size_.z() + c.z()) * size_.y() + c.y())] +
                  static_cast<std::size_t>(c.x())];
  }
  const Bits256& Mask(std::uint32_t index) const { return masks_[index]; }
  std::size_t distinct() const { return masks_.size(); }
  std::size_t bytes() const { return row_.bytes() + index_.bytes() + masks_.bytes(); }

 private:
  void Fill(const ContactMap& map);

  CellBox domain_;  ///< of window corners; beyond it masks repeat
  Cell size_;
  SharedArray<std::uint32_t> row_;    ///< where a row of window corners begins in index_
  SharedArray<std::uint32_t> index_;  ///< of masks, row after row
  SharedArray<Bits256> masks_;
};

}  // namespace feeler::planner
