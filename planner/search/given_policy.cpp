#include "feeler/planner/search/given_policy.h"

#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

namespace feeler::planner {

MoveMap MovesOf(BeliefGraph& graph, const PolicyGraph& policy) {
  MoveMap moves;
  const BeliefId start = graph.Start();
  if (start == kNoBelief) return moves;
  std::vector<std::pair<BeliefId, std::uint32_t>> open = {{start, policy.root}};
  while (!open.empty()) {
    const auto [b, at] = open.back();
    open.pop_back();
    const PolicyNode& node = policy.nodes[at];
    if (!moves.try_emplace(b, node.move).second) continue;
    for (const BeliefOutcome& outcome : graph.Outcomes(b, node.move)) {
      if (outcome.next == kNoBelief) continue;
      const auto branch = std::ranges::find(node.branches, outcome.outcome, &PolicyBranch::outcome);
      assert(branch != node.branches.end());
      open.emplace_back(outcome.next, branch->next);
    }
  }
  return moves;
}

}  // namespace feeler::planner
