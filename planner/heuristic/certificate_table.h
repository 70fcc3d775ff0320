#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/lattice.h"
#include "core/task.h"
#include "planner/contact/contact_map.h"
#include "planner/heuristic/certificate_walks.h"

namespace feeler::planner {

/// Costs of single steps below any guarded moves' costs: a free step of one cell, and a step into contact.
/// A move of n <= L cells costs per_cell n + per_contact [contact] + per_action. Give each cell travelled a share a of
/// per_action and each contact a share b; the shares of one move may not exceed it: a L <= 1 and a (L-1) + b <= 1. We
/// take a = 1/L, b = 1/L.
struct StepCosts {
  double free = 1.0;
  double contact = 0.0;
};
StepCosts LowerStepCosts(const CostWeights& cost, int longest_move);

/// For each displacement x of the tool and each subset M of the six neighbours h + e of a hypothesis h (e = +-(spread +
/// 1) cells along an axis): the least cost of a walk of single steps from x, as the tool fares under h, that returns
/// something else than it would under each neighbour in M.
///
/// Why its mean over the hypotheses of a belief is a lower bound: under the true hypothesis h a policy is one walk, and
/// when it ends every neighbour of h that was in the belief must have returned something else somewhere (neighbours are
/// further apart than a goal allows). The walk costs at least the table's entry. Guarded moves are walks of single
/// steps that show less (no look at the step after the last cell), so the bound holds for them too.
class CertificateTable {
 public:
  static constexpr int kMasks = 64;
  static constexpr std::uint16_t kUnreachable = kNoCertificate;

  CertificateTable(const ContactMap& map, const StepCosts& costs, const Cell& spread);

  /// Cost in problem units of one unit of the table.
  double unit() const { return unit_; }
  /// Offset from a hypothesis to the neighbour of bit i (+x, -x, +y, ...).
  const Cell& neighbour(int i) const { return neighbours_[static_cast<std::size_t>(i)]; }
  const CellBox& domain() const { return domain_; }
  int orientations() const { return orientations_; }

  std::size_t Index(const Cell& displacement) const {
    const Cell c = domain_.Clamp(displacement) - domain_.min;
    return static_cast<std::size_t>((std::int64_t{c.z()} * size_.y() + c.y()) * size_.x() + c.x());
  }
  /// Change of `Index` per cell along x, y, z, inside the domain.
  std::array<std::int64_t, 3> strides() const { return {1, size_.x(), std::int64_t{size_.x()} * size_.y()}; }
  std::size_t plane_size() const { return plane_size_; }
  /// Plane (orientation, mask) starts at (orientation * 64 + mask) * plane_size().
  const std::uint16_t* values() const { return values_.data(); }
  std::uint16_t At(const Cell& displacement, int mask, int orientation) const {
    return values_[static_cast<std::size_t>(orientation * kMasks + mask) * plane_size_ + Index(displacement)];
  }
  std::size_t bytes() const { return values_.size() * sizeof(values_[0]); }

 private:
  void FillOrientation(const ContactMap& map, int orientation, std::uint32_t free_units, std::uint32_t contact_units);

  CellBox domain_;
  Cell size_;
  int orientations_ = 1;
  std::size_t plane_size_ = 0;
  std::array<Cell, 6> neighbours_;
  double unit_ = 1.0;
  std::vector<std::uint16_t> values_;
};

}  // namespace feeler::planner
