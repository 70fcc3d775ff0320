#include "planner/solver/expand_policy.h"

#include <utility>

#include "core/error.h"
#include "planner/solver/policy_replay.h"

namespace feeler::planner {

ExpandedPolicy ExpandPolicy(const Problem& problem, const Policy& policy) {
  PolicyReplay replay = Replay(problem, policy);
  if (!replay.fault.empty()) throw NegativeResult("policy of " + problem.name, replay.fault);
  return std::move(replay.tree);
}

}  // namespace feeler::planner
