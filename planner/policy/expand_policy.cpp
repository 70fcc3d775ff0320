#include "feeler/planner/policy/expand_policy.h"

#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/policy/policy_replay.h"

namespace feeler::planner {

ExpandedPolicy ExpandPolicy(const Problem& problem, const PolicyGraph& policy) {
  PolicyReplay replay = Replay(problem, policy);
  if (!replay.fault.empty()) throw NegativeResult("policy of " + problem.name, replay.fault);
  return std::move(replay.tree);
}

}  // namespace feeler::planner
