#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/bounds/certificates/certificate_grid.h"
#include "feeler/planner/bounds/certificates/certificate_walks.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// For each displacement x of the tool and each subset M of the six neighbours h + e of a hypothesis h (e = +-(spread +
/// 1) cells along an axis): the least cost of a walk (of single steps, or of guarded moves: see StepCosts) from x, as
/// the tool fares under h, that returns something else than it would under each neighbour in M.
///
/// Why its mean over the hypotheses of a belief is a lower bound: under the true hypothesis h a policy is one walk, and
/// when it ends every neighbour of h that was in the belief must have returned something else somewhere (neighbours are
/// further apart than a goal allows). The walk costs at least the table's entry. Guarded moves are walks of single
/// steps that show less (no look at the step after the last cell), so the bound holds for them too.
class CertificateTable {
 public:
  static constexpr int kMasks = 64;
  static constexpr std::uint16_t kUnreachable = kNoCertificate;

  /// From the store, or made and kept there; its key stands for map, goal and the costs of moves.
  CertificateTable(const ContactMap& map, const StepCosts& costs, const Cell& spread,
                   const ArrayStore* store = nullptr);

  const CertificateGrid& grid() const { return grid_; }
  /// Offset from a hypothesis to the neighbour of bit i (+x, -x, +y, ...).
  const std::array<Cell, 6>& neighbours() const { return neighbours_; }
  int orientations() const { return orientations_; }

  /// Plane (orientation, mask) starts at (orientation * 64 + mask) * grid().cells.
  const std::uint16_t* values() const { return values_.data(); }
  std::uint16_t At(const Cell& displacement, int mask, int orientation) const {
    return values_[static_cast<std::size_t>(orientation * kMasks + mask) * grid_.cells + grid_.Index(displacement)];
  }
  /// The same, with the way back to the grid; 0 for no neighbours.
  std::uint32_t Further(const Cell& displacement, int mask, int orientation) const {
    return At(displacement, mask, orientation) + (mask == 0 ? 0 : grid_.WayBack(displacement));
  }
  std::size_t bytes() const { return values_.bytes(); }

 private:
  CertificateGrid grid_;
  int orientations_ = 1;
  std::array<Cell, 6> neighbours_;
  SharedArray<std::uint16_t> values_;
};

}  // namespace feeler::planner
