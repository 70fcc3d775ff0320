#include "planner/solver/carried_policy.h"

#include <algorithm>
#include <optional>

namespace feeler::planner {

CarriedPolicy::CarriedPolicy(BeliefGraph& graph, const Policy& policy, GreedyCompletion<BeliefGraph>& completion)
    : graph_(graph), policy_(policy), completion_(completion) {
  Follow(graph_.Start(), policy_.root);
}

double CarriedPolicy::Complete(BeliefId b) {
  completion_.Run(b, [](std::int64_t) { return std::optional<SolverStatus>(); });
  return completion_.Solved(b) ? completion_.Value(b) : kInfinity;
}

double CarriedPolicy::Follow(BeliefId b, std::uint32_t node) {
  const PolicyNode& here = policy_.nodes[node];
  if (here.is_leaf()) return Complete(b);
  const std::uint64_t key = std::uint64_t{b} << 32 | node;
  if (const auto known = followed_.find(key); known != followed_.end()) return known->second;
  const std::vector<BeliefOutcome> outcomes = graph_.Outcomes(b, here.move);
  const auto next_node = [&](const Outcome& outcome) {
    return std::ranges::find_if(here.branches, [&](const PolicyBranch& branch) { return branch.outcome == outcome; });
  };
  double value = 0.0;
  if (outcomes.size() == 1 && outcomes.front().next == b) {
    // Only hypotheses that are not in the belief made this move worth while: on without it.
    const auto branch = next_node(outcomes.front().outcome);
    value = branch == here.branches.end() ? Complete(b) : Follow(b, branch->next);
    followed_.emplace(key, value);
    return value;
  }
  // The belief's own action: the longest in this direction that is no longer (what is blocked before returns the same).
  if (!graph_.expanded(b)) ++expansions_;
  int action = -1;
  int index = 0;
  int cells = 0;
  for (const BeliefAction& listed : graph_.Actions(b)) {
    if (listed.direction == here.move.direction && listed.cells <= here.move.cells && listed.cells > cells) {
      action = index;
      cells = listed.cells;
    }
    ++index;
  }
  if (action < 0) {  // not applicable here
    value = Complete(b);
    followed_.emplace(key, value);
    return value;
  }
  for (const BeliefOutcome& outcome : outcomes) {
    value += outcome.weight * graph_.problem().cost.Of(outcome.outcome);
    if (outcome.next == kNoBelief) continue;
    const auto branch = next_node(outcome.outcome);
    value += branch == here.branches.end() ? Complete(outcome.next) : Follow(outcome.next, branch->next);
  }
  followed_.emplace(key, value);
  if (b >= nodes_.size()) nodes_.resize(std::max<std::size_t>(graph_.size(), b + std::size_t{1}));
  if (value < nodes_[b].value) nodes_[b] = {value, action};
  return value;
}

}  // namespace feeler::planner
