#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/lattice.h"
#include "feeler/core/lattice_grid.h"

namespace feeler::planner {

/// For one task: how far the tool can travel in each direction from each displacement relative to the target before
/// contact. The displacement of the tool at cell r under a hypothesis with offset h is r - h. One layer per orientation
/// of the target (one layer where orientation is certain).
///
/// Travel is continuous, in cells (metres / cell size). A step from a displacement to its neighbour is free iff the
/// travel is at least one cell; a guarded move of n cells travels min(n, floor(travel)) cells. Law: if a step is free,
/// travel(d + step) = travel(d) - 1 within the sampling tolerance.
///
/// The domain is a box; beyond it the map repeats its outermost layer (a displacement is clamped to the domain; travel
/// back towards the domain is longer by the distance to it), so a builder leaves a free border around the target, and
/// panels continue as they were at the border. Immutable once built; safe to read from many threads.
class ContactMap {
 public:
  /// Travel of a direction that meets nothing.
  static constexpr float kUnlimited = 1e9F;

  struct Layer {
    std::vector<std::uint8_t> blocked;           ///< per displacement: 1 if the tool overlaps the target there
    std::vector<float> travel[kDirectionCount];  ///< per direction and displacement: cells to contact
  };
  /// The same, in memory that the map keeps.
  struct LayerView {
    std::span<const std::uint8_t> blocked;
    std::array<std::span<const float>, kDirectionCount> travel;
  };

  /// Displacements are stored x fastest, then y, then z. Blocked displacements have travel 0.
  /// Throws InputError if sizes do not fit the domain.
  ContactMap(CellBox domain, std::vector<Layer> layers, Eigen::Vector3d phase, double margin_cells);
  /// The same of layers that `owner` keeps: a file that is mapped.
  ContactMap(CellBox domain, std::vector<LayerView> layers, std::shared_ptr<const void> owner, Eigen::Vector3d phase,
             double margin_cells);

  const CellBox& domain() const { return domain_; }
  int orientations() const { return static_cast<int>(layers_.size()); }
  /// Where lattice points lie between cells: displacement in metres = (cells + phase) * cell size.
  const Eigen::Vector3d& phase() const { return phase_; }
  /// Smallest distance from a wall to a lattice plane, in cells (0.5 at best).
  double margin_cells() const { return margin_cells_; }

  bool Blocked(const Cell& displacement, int orientation = 0) const {
    return layer(orientation).blocked[Index(displacement)] != 0;
  }
  float Travel(const Cell& displacement, Direction d, int orientation = 0) const {
    const float at_border = layer(orientation).travel[static_cast<std::size_t>(IndexOf(d))][Index(displacement)];
    const int axis = AxisOf(d);
    const int overshoot = (domain_.Clamp(displacement)[axis] - displacement[axis]) * SignOf(d);
    return overshoot > 0 ? at_border + static_cast<float>(overshoot) : at_border;
  }
  bool StepFree(const Cell& displacement, Direction d, int orientation = 0) const {
    return Travel(displacement, d, orientation) >= 1.0F;
  }
  /// What a guarded move from this displacement returns.
  Outcome Predict(const Cell& displacement, const GuardedMove& move, int orientation = 0) const;

  const LayerView& layer(int orientation) const { return layers_[static_cast<std::size_t>(orientation)]; }
  Layer CopyOfLayer(int orientation) const;
  std::size_t bytes() const {
    return static_cast<std::size_t>(domain_.Count()) * layers_.size() * (1 + kDirectionCount * sizeof(float));
  }
  std::size_t Index(const Cell& displacement) const {
    return GridIndex(size_, domain_.Clamp(displacement) - domain_.min);
  }

 private:
  struct Unchecked {};
  ContactMap(CellBox domain, std::vector<LayerView> layers, std::shared_ptr<const void> owner, Eigen::Vector3d phase,
             double margin_cells, Unchecked tag);
  void Check() const;

  CellBox domain_;
  Cell size_;
  std::vector<LayerView> layers_;
  std::shared_ptr<const void> owner_;  ///< of what they see
  Eigen::Vector3d phase_;
  double margin_cells_;
};

}  // namespace feeler::planner
