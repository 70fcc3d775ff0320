#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// An alpha vector over all states of the model: V*(b) >= sum_s b(s) values(s), by a plan that begins with `action`.
struct FullAlphaVector {
  std::uint32_t action = 0;
  std::vector<SparseEntry> values;  ///< of the states the plan is made for
  double elsewhere = 0.0;           ///< a lower bound for all other states
};

/// The action of the vector that is worth most at a belief.
std::uint32_t BestAction(const std::vector<FullAlphaVector>& alphas, std::span<const SparseEntry> belief);

}  // namespace feeler::planner
