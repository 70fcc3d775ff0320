#include "feeler/workflow/setup/noisy_policies.h"

#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/noise/solve_noisy.h"

namespace feeler::workflow {

std::shared_ptr<const planner::NoisyPolicy> NoisyPolicies::For(const planner::Problem& problem,
                                                               const planner::Extents& extents) {
  if (!options_.noise.any()) {
    throw InputError("--policy noisy", "no noise is given",
                     "give --policy-option missed-contact=P, false-stop=P or slip=P, probabilities of a single step");
  }
  if (problem.map->orientations() > 1) {
    throw InputError("--policy noisy", "the orientation of the target is uncertain",
                     "hypotheses are weighed for uncertain positions alone; take another policy");
  }
  const std::lock_guard lock(mutex_);
  const auto [known, added] = known_.try_emplace(extents);
  if (!added && known->second) return known->second;
  planner::SolverOptions options;
  options.gap = options_.gap;
  options.expansion_limit = options_.expansion_limit;
  planner::NoisyResult result = planner::SolveNoisy({problem, options_.noise, options_.declaration}, options);
  known->second = std::make_shared<const planner::NoisyPolicy>(std::move(result.policy));
  return known->second;
}

}  // namespace feeler::workflow
