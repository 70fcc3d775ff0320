#pragma once

#include "feeler/core/lattice.h"
#include "feeler/planner/belief/hypothesis_sets.h"

namespace feeler::planner {

/// A lower bound on the optimal expected cost of a belief, times the weight of the belief. One object serves one belief
/// store (it may cache per set); the tables behind it are shared. Infinity where some pair cannot be told apart.
///
/// Laws: admissible (at most weight * V*), zero at goals, and consistent: weight(b) h(b) <= cost of an action + sum
/// over its successors.
class BeliefHeuristic {
 public:
  virtual ~BeliefHeuristic() = default;
  /// `robot` is relative to the set's frame.
  virtual double Weighted(SetId set, const Cell& robot) = 0;
  /// A guess at the optimal expected cost times the weight, for choosing among actions; no bound.
  virtual double Estimate(SetId set, const Cell& robot) { return Weighted(set, robot); }
  /// Memory of what is cached per set.
  virtual std::size_t bytes() const { return 0; }
};

}  // namespace feeler::planner
