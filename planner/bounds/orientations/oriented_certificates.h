#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "feeler/core/lattice_grid.h"
#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/planner/bounds/certificates/certificate_grid.h"
#include "feeler/planner/bounds/orientations/difference_rows.h"
#include "feeler/planner/contact/step_flags_grid.h"

namespace feeler::planner {

/// A hypothesis beside another: so many cells away, or so many angles.
struct OrientedNeighbour {
  Cell offset = Cell::Zero();
  int yaw = 0;
  int pitch = 0;
};

/// The displacements for which walks of one hypothesis are tabled, a byte each; beyond the box everything repeats and
/// walks are projected (see CertificateGrid).
struct OrientedBox {
  CellBox domain;
  Cell size = Cell::Zero();
  std::array<bool, 3> free_above{}, free_below{};
  std::size_t cells = 0;

  OrientedBox() = default;
  OrientedBox(const StepFlagsGrid::Region& region, const Cell& reach);
  std::size_t Index(const Cell& displacement) const { return GridIndex(size, domain.Clamp(displacement) - domain.min); }
  std::array<std::int64_t, 3> strides() const { return GridStrides(size); }
  /// Cells of the way back to the box, where nothing can be told before.
  std::uint32_t WayBack(const Cell& displacement) const;
};

/// Certificates (see CertificateTable) where the target has orientations: for each orientation o, displacement x and
/// subset M of up to eight neighbours of a hypothesis - along the axes of position and angle in which the hypotheses of
/// the problem differ - the least cost of a walk of single steps from x, as the tool fares under orientation o, that
/// returns something else than it would under each neighbour in M.
///
/// Bytes, in units of a free step, rounded down and cut at kMost: still a lower bound, and exact where only distance
/// costs. For one orientation all subsets are tabled at once, with a subset a lane: whether a step is free does not
/// depend on the subset.
class OrientedCertificates {
 public:
  static constexpr int kMostNeighbours = 8;
  static constexpr std::uint8_t kNone = 255;  ///< some neighbour cannot be told apart
  static constexpr std::uint8_t kMost = 254;

  /// For the orientations, goal and axes of the hypotheses of `problem`. Unusable after a cancellation. From the store,
  /// or made and kept there; its key stands for all other arguments.
  OrientedCertificates(const Problem& problem, const StepFlagsGrid& flags, const StepCosts& costs, Parallelism jobs,
                       const ProgressCallback& progress, const CancellationToken* cancellation = nullptr,
                       const ArrayStore* store = nullptr);

  const std::vector<OrientedNeighbour>& neighbours() const { return neighbours_; }
  /// Cost in problem units of a unit of the table.
  double unit() const { return unit_; }
  /// The orientation of a neighbour; -1 if there is none in the table.
  int NeighbourOf(int orientation, std::size_t neighbour) const {
    return layers_[static_cast<std::size_t>(orientation)].neighbour[neighbour];
  }
  /// False for orientations that no hypothesis of the problem has.
  bool Tabled(int orientation) const {
    return static_cast<std::size_t>(orientation) < layers_.size() &&
           layers_[static_cast<std::size_t>(orientation)].lanes > 0;
  }
  const OrientedBox& box(int orientation) const { return layers_[static_cast<std::size_t>(orientation)].box; }
  using Plane = DifferenceRows<std::uint8_t>::Lane;
  /// The values of a subset of neighbours (all of them tabled), by box(orientation).Index.
  Plane PlaneOf(int orientation, unsigned subset) const;
  std::size_t bytes() const;

 private:
  struct Layer {
    OrientedBox box;
    int lanes = 0;
    std::array<int, kMostNeighbours> neighbour{};  ///< orientations, -1: none
    std::array<int, kMostNeighbours> lane_bit{};   ///< of a neighbour, -1: none
    DifferenceRows<std::uint8_t> values;
  };
  void Fill(const StepFlagsGrid& flags, int orientation, int contact_units);

  std::vector<OrientedNeighbour> neighbours_;
  double unit_ = 1.0;
  std::vector<Layer> layers_;
};

}  // namespace feeler::planner
