#pragma once

#include "feeler/planner/noise/noisy_policy.h"
#include "feeler/planner/noise/noisy_problem.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::planner {

/// A policy that knows of no noise, carried out in the noisy world: exactly, over every hypothesis. Readings are taken
/// by the cells travelled (a contact that is missed is noticed by the tool falling short); one that the policy has no
/// branch for ends it, which counts as giving up; at its leaves it declares what is left. The policy must be one
/// without canonical translation (all shifts zero), and valid for the problem.
NoisyEvaluation CarryOut(const NoisyProblem& noisy, const PolicyGraph& policy);

}  // namespace feeler::planner
