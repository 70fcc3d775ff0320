#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/lattice.h"
#include "core/task.h"
#include "planner/contact/contact_map.h"

namespace feeler::planner {

/// Costs of single steps below any guarded moves' costs: a free step of one cell, and a step into contact.
/// A move of n <= L cells costs per_cell n + per_contact [contact] + per_action. Give each cell travelled a share a of
/// per_action and each contact a share b; the shares of one move may not exceed it: a L <= 1 and a (L-1) + b <= 1. We
/// take a = 1/L, b = 1/L.
struct StepCosts {
  double free = 1.0;
  double contact = 0.0;
  double start = 0.0;
};
StepCosts LowerStepCosts(const CostWeights& cost, int longest_move);
/// Costs of walks made of motions: a motion costs `start`, goes straight on and ends at will or by a contact. A guarded
/// move is a motion at just its cost, so bounds from these are tighter than from shares wherever per_action is not
/// zero. Where cells are free of cost the shares above stand.
StepCosts MotionCosts(const CostWeights& cost, int longest_move);

/// The displacements for which certificates are tabled, and the unit of the tables. Two cells beyond all that a walk
/// could meet, everything repeats for ever and a walk can be projected back.
struct CertificateGrid {
  /// `reach`: how far (per axis) the hypotheses that are to be told apart lie from each other.
  CertificateGrid(const ContactMap& map, const StepCosts& costs, const Cell& reach);
  CertificateGrid() = default;

  std::size_t Index(const Cell& displacement) const {
    const Cell c = domain.Clamp(displacement) - domain.min;
    return static_cast<std::size_t>((std::int64_t{c.z()} * size.y() + c.y()) * size.x() + c.x());
  }
  /// Change of `Index` per cell along x, y, z, inside the domain.
  std::array<std::int64_t, 3> strides() const { return {1, size.x(), std::int64_t{size.x()} * size.y()}; }

  CellBox domain;
  Cell size = Cell::Zero();
  std::size_t cells = 0;
  std::uint32_t free_units = 1;  ///< of a free step
  std::uint32_t contact_units = 0;
  std::uint32_t start_units = 0;
  double unit = 1.0;  ///< cost in problem units of one unit of the tables
};

/// Fills planes[mask * grid.cells + grid.Index(x)], for each subset `mask` of `others` (at most 6 offsets from a
/// hypothesis h), with the least cost of a walk of single steps from displacement x, as the tool fares under h, that
/// returns something else than it would under each other hypothesis of the subset; kNoCertificate where there is none.
void TableCertificates(const ContactMap& map, int orientation, const CertificateGrid& grid,
                       std::span<const Cell> others, std::uint16_t* planes);

}  // namespace feeler::planner
