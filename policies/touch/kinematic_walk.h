#pragma once

#include <string>

#include "feeler/planner/belief/problem.h"
#include "feeler/policies/policy.h"

namespace feeler::policies {

/// What a policy came to when the target stood exactly at a hypothesis and every guarded move returned what the contact
/// map says.
struct KinematicWalk {
  bool localized = false;  ///< it ended with Insert, in a belief that is a goal of the problem
  std::string reason;      ///< "localized", or why not
  double cost = 0.0;       ///< by the weights of the problem
  int cells = 0;           ///< travelled
  int moves = 0;
  int contacts = 0;
  double cpu_s = 0.0;  ///< of the calls of the policy: planning. Measured
};

/// Walks a policy through a problem; gives up after `most_moves`. What the policy throws is passed on.
KinematicWalk Walk(const planner::Problem& problem, Policy& policy, const Hypothesis& truth, int most_moves = 2000);

}  // namespace feeler::policies
