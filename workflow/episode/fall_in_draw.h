#pragma once

#include <optional>

#include "feeler/core/pose.h"
#include "feeler/core/random.h"
#include "feeler/core/task.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/policies/policy.h"

namespace feeler::workflow {

/// A pose of the target, among those that the problem holds possible, for which a guarded move of the policy along the
/// insertion axis comes down on the middle of the opening, so that the tool falls into it: hypotheses are tried in
/// drawn order, each by walking the policy on the contact map. Empty if the policy probes no opening.
std::optional<Pose> DrawFallIn(const Task& task, const planner::Problem& problem, policies::Policy& policy,
                               const Pose& world_T_estimate, RandomStream& random);

}  // namespace feeler::workflow
