#pragma once

#include <cstdint>

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/search/greedy_completion.h"

namespace feeler::planner {

/// The judgement of one of many runs of greedy completion, drawn at random: cells along x, y and z seem 0.6 to 1.65
/// times as dear as they are (so that some runs feel along one axis first, others along another), and a belief of n
/// hypotheses seems to cost 1 to 2 times its heuristic plus the cost of 0 to 2 moves of one cell for each of its
/// log2(n) bits. The graph must outlive it. The same for the same seed and number.
GreedyCompletion<BeliefGraph>::Judgement RandomJudgement(const BeliefGraph& graph, std::uint64_t seed,
                                                         std::uint64_t number);

}  // namespace feeler::planner
