#pragma once

#include <array>
#include <cstdint>

#include "feeler/core/direction.h"
#include "feeler/core/lattice.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// What `StepFlags` returns for displacements that no motion can reach.
inline constexpr std::uint8_t kOutOfReach = 1U << kDirectionCount;
/// Bit d: the step in direction d is blocked. kOutOfReach inside the target (unless a free step leads there by
/// rounding).
std::uint8_t StepFlags(const ContactMap& map, const Cell& displacement, int orientation);

/// The part of a contact map where something happens.
struct ActiveRegion {
  explicit ActiveRegion(const ContactMap& map);

  /// Beyond this box the map repeats the box's outermost layer.
  CellBox box;
  CellBox whole;  ///< the map's domain
  /// Per axis: nothing is blocked in the outermost layer, nor beyond it.
  std::array<bool, 3> free_above{};
  std::array<bool, 3> free_below{};
  /// Per axis: the box is its own mirror image.
  std::array<bool, 3> mirrored{};
};

}  // namespace feeler::planner
