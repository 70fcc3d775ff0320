#pragma once

#include <string>
#include <vector>

#include "feeler/planner/policy/expand_policy.h"

namespace feeler::planner {

/// A policy unrolled over its problem, as far as it is valid: shared by `Evaluate` and `ExpandPolicy`.
struct PolicyReplay {
  ExpandedPolicy tree;
  std::string fault;  ///< empty if the policy is valid
};

/// Carries the whole set of hypotheses down the graph, splitting it by what each would return, and checks every step.
PolicyReplay Replay(const Problem& problem, const PolicyGraph& policy);

}  // namespace feeler::planner
