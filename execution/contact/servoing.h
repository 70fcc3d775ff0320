#pragma once

#include "feeler/execution/contact/mover.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/policies/policy.h"

namespace feeler::execution {

/// Lets the policy lead the tool by what the camera sees, from its first Servo decision until it decides otherwise, and
/// stops. Returns the last decision; throws LostTrack where the policy gives up or the tool touches something, and
/// ExecutionFailure when robot or limits end it.
policies::Decision FollowByEye(const planner::Problem& problem, const policies::Decision& first,
                               policies::Policy& policy, Mover& mover, ExecutionRecord& record);

}  // namespace feeler::execution
