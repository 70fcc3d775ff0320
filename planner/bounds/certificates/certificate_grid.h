#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/core/lattice_grid.h"
#include "feeler/core/task.h"
#include "feeler/planner/contact/active_region.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// Costs of single steps below any guarded moves' costs: a free step of one cell, and a step into contact.
/// A move of n <= L cells costs per_cell n + per_contact [contact] + per_action. Give each cell travelled a share a of
/// per_action and each contact a share b; the shares of one move may not exceed it: a L <= 1 and a (L-1) + b <= 1. We
/// take a = 1/L, b = 1/L.
struct StepCosts {
  double free = 1.0;
  double contact = 0.0;
  double start = 0.0;
  /// Of guarded moves, where setting out costs something; none: motions of any length.
  std::vector<int> lengths = {};
  /// What a step along each axis costs beyond `free`, where walks are made of guarded moves; elsewhere the least of the
  /// axes stands for all of them, which is a bound too.
  std::array<double, 3> beyond{};
  /// Of a free step that returns something else than under another hypothesis (it may be less than `free` where
  /// readings are noisy); negative: as any free step. Not for walks made of guarded moves.
  double look = -1.0;
};
StepCosts LowerStepCosts(const CostWeights& cost, int longest_move);
/// Costs of walks made of guarded moves as they are: bounds from these are tighter than from shares wherever per_action
/// is not zero. Where moves are too long for the tables (GuardedWalks::kLongest) walks are made of motions: a motion
/// costs `start`, goes straight on and ends at will or by a contact. Where cells are free of cost the shares stand.
StepCosts MotionCosts(const CostWeights& cost, const std::vector<int>& lengths);

/// Costs in whole table units.
struct TableUnits {
  explicit TableUnits(const StepCosts& costs);
  TableUnits() = default;
  std::uint32_t free_units = 1;  ///< of a free step
  std::uint32_t look_units = 1;  ///< of a free step that tells something
  std::uint32_t contact_units = 0;
  std::uint32_t start_units = 0;
  std::array<std::uint32_t, 3> beyond_units{};  ///< of a free step along each axis, on top of free_units
  double unit = 1.0;                            ///< cost in problem units of one unit of the tables
};

/// The displacements for which certificates are tabled, and the unit of the tables. Two cells beyond all that a walk
/// could meet, everything repeats for ever and a walk can be projected back. On sides where nothing is in the way the
/// grid reaches kFreeMargin cells out, as far as the map does; who is further out has at least the way back to go.
struct CertificateGrid : TableUnits {
  static constexpr int kFreeMargin = 24;

  /// `reach`: how far (per axis) the hypotheses that are to be told apart lie from each other.
  CertificateGrid(const ActiveRegion& region, const StepCosts& costs, const Cell& reach);
  CertificateGrid(const ContactMap& map, const StepCosts& costs, const Cell& reach)
      : CertificateGrid(ActiveRegion(map), costs, reach) {}
  CertificateGrid() = default;

  std::size_t Index(const Cell& displacement) const { return GridIndex(size, domain.Clamp(displacement) - domain.min); }
  /// Cost in table units of the way back to the grid, where nothing can be told before.
  std::uint32_t WayBack(const Cell& displacement) const {
    if (domain.Contains(displacement)) return 0;
    int cells_back = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      if (free_above[i]) cells_back += std::max(0, displacement[axis] - domain.max[axis]);
      if (free_below[i]) cells_back += std::max(0, domain.min[axis] - displacement[axis]);
    }
    return static_cast<std::uint32_t>(cells_back) * free_units;
  }
  /// Change of `Index` per cell along x, y, z, inside the domain.
  std::array<std::int64_t, 3> strides() const { return GridStrides(size); }

  CellBox domain;
  Cell size = Cell::Zero();
  std::size_t cells = 0;
  std::array<bool, 3> free_above{}, free_below{};
  std::vector<int> lengths;  ///< see StepCosts
};

/// Fills planes[mask * grid.cells + grid.Index(x)], for each subset `mask` of `others` (at most 6 offsets from a
/// hypothesis h), with the least cost of a walk from displacement x, as the tool fares under h, that
/// returns something else than it would under each other hypothesis of the subset; kNoCertificate where there is none.
void TableCertificates(const ContactMap& map, int orientation, const CertificateGrid& grid,
                       std::span<const Cell> others, std::uint16_t* planes);

}  // namespace feeler::planner
