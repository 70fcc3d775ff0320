#pragma once

#include <optional>

#include "feeler/planner/belief/problem.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::planner {

/// A policy that was found as if the workspace were unbounded, made to stay in it: a move whose far end lies outside,
/// though all its outcomes are contacts inside, is made in pieces of listed lengths that end with the furthest contact.
/// That costs the same but for the cost of the further actions; the costs of the result are exact, its bound is that of
/// `policy`. Empty where the policy cannot be mended so.
std::optional<PolicyGraph> FitIntoWorkspace(const Problem& problem, const PolicyGraph& policy);

}  // namespace feeler::planner
