#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "feeler/planner/belief/contact_masks.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::planner {

/// All pairs of hypotheses that no sequence of moves from the start tells apart and that the goal needs apart, as
/// indices in problem order (at most `most_pairs`). Not being told apart is an equivalence, because a move that showed
/// nothing can be taken back; so the hypotheses are refined into classes: flood the cells that are free under all of a
/// class, split it by every probe met, repeat with the parts.
std::vector<std::pair<int, int>> IndistinguishablePairs(const Problem& problem, const ContactMasks& masks,
                                                        std::size_t most_pairs = 1000);

/// How many there are in all.
std::int64_t CountIndistinguishablePairs(const Problem& problem, const ContactMasks& masks);

}  // namespace feeler::planner
