#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "feeler/core/direction.h"

namespace feeler {

/// A lattice point or a lattice offset, in cells.
using Cell = Eigen::Vector3i;

/// An axis-aligned box of lattice points, both corners included; empty when a component of `max` is below `min`.
struct CellBox {
  Cell min = Cell::Zero();
  Cell max = Cell::Constant(-1);

  bool Contains(const Cell& c) const { return (c.array() >= min.array()).all() && (c.array() <= max.array()).all(); }
  Cell Size() const { return (max - min + Cell::Ones()).cwiseMax(0); }
  std::int64_t Count() const {
    const Cell s = Size();
    return std::int64_t{s.x()} * s.y() * s.z();
  }
  Cell Clamp(const Cell& c) const { return c.cwiseMax(min).cwiseMin(max); }
  bool operator==(const CellBox& o) const { return min == o.min && max == o.max; }
};

/// A straight tool motion along an axis, of at most `cells` cells (>= 1), that stops at first contact.
struct GuardedMove {
  Direction direction = Direction::kPlusX;
  int cells = 1;
  bool operator==(const GuardedMove&) const = default;
};

/// What a guarded move returns. Contact is true exactly when fewer cells were travelled than were asked for.
struct Outcome {
  int cells = 0;
  bool contact = false;
  bool operator==(const Outcome&) const = default;
};

}  // namespace feeler
