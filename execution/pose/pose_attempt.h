#pragma once

#include <string>

#include "feeler/core/pose.h"
#include "feeler/execution/lattice/attempt.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/planner/contact/travel_model.h"
#include "feeler/policies/policy.h"

namespace feeler::execution {

/// True if the orientation of the target is uncertain in this problem.
bool HasAngles(const planner::Problem& problem);

/// Localizes a target of uncertain orientation and inserts. A leaf of the policy is only a seed here: between lattice
/// orientations every wall is slanted, and no reading rounds to an outcome for sure.
/// 1. Follows the policy to a leaf, taking for each reading the branch of the hypothesis that explains all of them
/// best.
/// 2. Fits the continuous pose to all motions felt (FitPose, several starts), and touches where the poses that are left
///    differ most (ChooseTouch), until position and tilt are known well enough and a touch has confirmed the fit.
/// 3. Turns the tool to the fitted pose and inserts; blocked: comes off, touches on, tries again.
/// Fills the record as it goes; returns the reason. `model` is the geometry with the opening as physics has it. Throws
/// ExecutionFailure for what no further touch can mend.
std::string RunPoseAttempt(const Episode& episode, const planner::Problem& problem, const Pose& world_T_estimate,
                           policies::Policy& policy, planner::TravelModel& model);

}  // namespace feeler::execution
