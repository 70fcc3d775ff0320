#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "feeler/core/direction.h"

namespace feeler::planner {

inline constexpr std::uint16_t kNoCertificate = 0xFFFF;

/// The walks of the tool under one hypothesis, on a grid of cells: which steps are free, and which show that other
/// hypotheses are wrong.
struct CertificateWalks {
  struct Probe {
    std::uint32_t from = 0;
    std::uint32_t to = 0;    ///< where the tool is afterwards
    std::uint32_t cost = 0;  ///< in table units
    Direction direction = Direction::kPlusX;
    bool contact = false;
    std::uint32_t shows = 0;  ///< bit i: the step would have returned something else under other hypothesis i
  };
  std::vector<Probe> probes;
  std::vector<std::uint8_t> enters;       ///< per cell, bit d: the step in direction d into it is free
  std::array<std::int64_t, 3> strides{};  ///< of cell indices along x, y, z
  std::uint32_t step_cost = 1;            ///< of a free step, in table units
  /// Of setting out: a walk is made of motions, each straight on and ended at will or by a contact.
  std::uint32_t start_cost = 0;
};

/// Fills planes[mask * cells + cell], for every mask of `bits` others, with the least cost of a walk from the cell that
/// shows all others in the mask to be wrong; kNoCertificate where there is none. Saturates at kNoCertificate - 1 (still
/// a lower bound).
void FillCertificates(const CertificateWalks& walks, int bits, std::uint16_t* planes);

}  // namespace feeler::planner
