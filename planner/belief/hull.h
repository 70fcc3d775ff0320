#pragma once

#include <span>

#include "feeler/core/lattice.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::planner {

/// The least box around the offsets of the hypotheses, of which there must be one at least.
inline CellBox HullOf(std::span<const Hypothesis> hypotheses) {
  CellBox hull{hypotheses.front().offset, hypotheses.front().offset};
  for (const Hypothesis& h : hypotheses) {
    hull.min = hull.min.cwiseMin(h.offset);
    hull.max = hull.max.cwiseMax(h.offset);
  }
  return hull;
}

}  // namespace feeler::planner
