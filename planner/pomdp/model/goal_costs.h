#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// A Markov chain with costs and goals. Rows of goals are not looked at.
struct GoalChain {
  SparseRows rows;           ///< P(j | i); a state may stand in a row twice
  std::vector<double> cost;  ///< at least 0
  std::vector<std::uint8_t> goal;
};

/// By state, an upper bound of the expected cost until a goal that is the cost itself up to rounding; infinite where a
/// goal is not reached for certain. By Gauss-Seidel sweeps, which also count the expected steps N: w + N max(residual)
/// is above the cost (of what the sweeps leave, each step pays the residual at most). Where they creep, by elimination
/// of states. Higher where `stop` cuts it short, or the sweeps creep and there are too many states for that; nothing
/// where that leaves no bound.
std::optional<std::vector<double>> GoalCosts(const GoalChain& chain, const std::function<bool()>& stop = {});

}  // namespace feeler::planner
