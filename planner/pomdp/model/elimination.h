#pragma once

#include <optional>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {

struct EliminationResult {
  std::vector<double> cost;   ///< expected, until a goal
  std::vector<double> steps;  ///< the same at a cost of 1 a step
};

/// Solves (1 - p_ii) x_i = c_i + sum_{j != i} p_ij x_j by taking one state after the other out of the chain, what leads
/// to it going on to what follows it (Grassmann, Taksar and Heyman 1985): nothing is subtracted, so that chains which
/// take 1e12 steps lose no digits. `rows` without what stays; `to_goal` what leads to goals at once. States of few
/// neighbours first. Every state must come to a goal for certain. Nothing where what is filled in would take too much
/// memory.
std::optional<EliminationResult> EliminateStates(const SparseRows& rows, const std::vector<double>& to_goal,
                                                 const std::vector<double>& cost, Pulse& pulse);

}  // namespace feeler::planner
