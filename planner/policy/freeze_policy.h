#pragma once

#include <functional>
#include <vector>

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::planner {

/// The policy that makes the move `move_of(b)` at every belief it reaches from the start; must be acyclic. Costs are
/// summed exactly; the lower bound is left zero.
PolicyGraph FreezePolicy(BeliefGraph& graph, const std::function<GuardedMove(BeliefId)>& move_of);

/// Per node: 1 if its move leaves the problem's workspace from some place where it is reached.
std::vector<char> NodesThatLeaveWorkspace(const Problem& problem, const PolicyGraph& policy);
/// True if every move stays in the problem's workspace (for graphs that took it to be unbounded).
bool StaysInWorkspace(const Problem& problem, const PolicyGraph& policy);

}  // namespace feeler::planner
