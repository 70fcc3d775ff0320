#pragma once

#include <functional>
#include <unordered_map>

#include "feeler/planner/belief/belief_graph.h"

namespace feeler::planner {

/// A policy as a map from beliefs to moves.
using MoveMap = std::unordered_map<BeliefId, GuardedMove>;

/// Of the policies that cost no more than a given one, one with few moves. Where only distance costs, one move of eight
/// cells and eight of one cell cost the same, and a robot cares. Walks that show nothing are replaced by straight ones
/// (each axis once) where those are free and no longer; then, from the leaves up, each belief takes the move of least
/// expected number of moves among those whose expected cost is not above the belief's and whose outcomes have a known
/// policy.
MoveMap FewestMoves(BeliefGraph& graph, const std::function<GuardedMove(BeliefId)>& move_of);

}  // namespace feeler::planner
