#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/lattice.h"

namespace feeler::planner {

/// The guarded moves of the tool under one hypothesis, on a grid of cells (x fastest).
struct GuardedWalks {
  static constexpr int kMostOthers = 8;

  Cell size = Cell::Ones();
  std::vector<int> lengths;  ///< of moves, ascending; at most kLongest
  std::uint32_t step_cost = 1;
  std::array<std::uint32_t, 3> beyond_step{};  ///< of a step along x, y, z, on top of step_cost
  std::uint32_t contact_cost = 0;
  std::uint32_t action_cost = 0;
  /// The grid stands for an unbounded lattice whose outermost layers repeat: moves end at the border, and from there
  /// inward moves have any length up to the longest (of one that began outside only a part is left).
  bool projected = false;
  /// Per direction and cell: steps until contact, at most kLongest.
  std::array<std::vector<std::uint8_t>, kDirectionCount> travel;
  /// Per direction and cell: the longest move that may be made (0 where the tool cannot be).
  std::array<std::vector<std::uint8_t>, kDirectionCount> longest;
  /// Moves that may tell something: travel under the other hypotheses where it is not the same under all.
  struct Telling {
    std::uint32_t cell = 0;
    Direction direction = Direction::kPlusX;
    std::array<std::uint8_t, kMostOthers> travel{};
  };
  std::vector<Telling> telling;

  static constexpr int kLongest = 64;
};

/// Fills planes[mask * cells + cell], for every mask of `bits` others, with the least cost of a sequence of guarded
/// moves from the cell whose outcomes show all others in the mask to be wrong; kNoCertificate where there is none.
/// Saturates at kNoCertificate - 1 (still a lower bound).
void FillGuardedCertificates(const GuardedWalks& walks, int bits, std::uint16_t* planes);

}  // namespace feeler::planner
