#pragma once

#include <vector>

#include "feeler/planner/belief/noise.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::planner {

/// A problem whose readings are noisy. Exact semantics: docs/planner.md, "Noise".
struct NoisyProblem {
  Problem problem;
  Noise noise;
  Declaration declaration;

  /// Of a wrong declaration, and of giving up, in the unit of the problem's costs.
  double WrongCost() const {
    return declaration.wrong_cells * (problem.cost.per_cell > 0.0 ? problem.cost.per_cell : problem.cost.per_action);
  }
};

/// Throws InputError if the problem, the noise or the declaration is invalid.
void Validate(const NoisyProblem& noisy);

/// What may be declared: the largest sets of hypotheses that are goals (one each under goal `singleton`; under goal
/// `insertable` what boxes of the insertable spread hold, per orientation). Indices in problem order, ascending.
std::vector<std::vector<int>> LargestGoalSets(const Problem& problem);

}  // namespace feeler::planner
