#pragma once

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/policy/policy_graph.h"
#include "feeler/planner/search/fewest_moves.h"

namespace feeler::planner {

/// The moves of a valid policy for the graph's problem, at the beliefs that it reaches from the start: whatever frames
/// and weights it was found with.
MoveMap MovesOf(BeliefGraph& graph, const PolicyGraph& policy);

}  // namespace feeler::planner
