#pragma once

#include "feeler/planner/belief/problem.h"
#include "feeler/planner/policy/policy_graph.h"

/// A solver of one's own, for goal `singleton`: from every belief the fewest moves whose outcomes all hypotheses share,
/// then the first move that tells some of them apart. Throws feeler::NegativeResult if no move does.
feeler::planner::PolicyGraph SolveByNearestSplit(const feeler::planner::Problem& problem);
