#pragma once

#include <cstdint>

#include "feeler/planner/noise/noisy_policy.h"
#include "feeler/planner/noise/noisy_problem.h"
#include "feeler/planner/options/solver_options.h"
#include "feeler/planner/options/solver_result.h"

namespace feeler::planner {

struct NoisyResult {
  SolverStatus status = SolverStatus::kConverged;
  NoisyPolicy policy;
  NoisyEvaluation evaluation;  ///< of the policy
  double lower_bound = 0.0;    ///< proven
  std::int64_t trials = 0;
  std::int64_t expansions = 0;  ///< beliefs whose actions were all evaluated, and those of the first policy
  std::size_t beliefs = 0;
  double cpu_s = 0.0;  ///< of the solving thread
  double wall_s = 0.0;

  double Ratio() const;
};

/// Solves a noisy problem by the searches of problems without noise, on another BeliefModel (NoisyBeliefGraph): the
/// certified solver from a first policy (ConfirmedPolicy) between two bounds, or RTDP-Bel (E-RTDP-Bel is the same here:
/// there is no experience). `options` as in Solve; its heuristic is the first policy's. Deterministic but for time
/// limits and cancellation. Throws InputError for an invalid problem or options.
NoisyResult SolveNoisy(const NoisyProblem& noisy, const SolverOptions& options);

}  // namespace feeler::planner
