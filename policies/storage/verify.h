#pragma once

#include <string>

#include "feeler/planner/belief/problem.h"
#include "feeler/policies/storage/database.h"

namespace feeler::policies {

/// What a replay of a stored policy found.
struct RowVerification {
  std::string fault;           ///< empty if the row holds
  double replayed_cost = 0.0;  ///< exact, over every hypothesis
  bool valid() const { return fault.empty(); }
};

/// Replays the stored policy against the contact map of `problem` under every hypothesis of its start belief, and
/// compares: every history ends localized, the mean cost is the stored one within 1e-9 (relative above 1), the lower
/// bound does not exceed it, every node's cost to go is that of its subtree. A row without a policy holds trivially.
/// `problem`: the start belief of the row's extents (planner::MakeCuboidProblem).
RowVerification VerifyRow(const StoredProblem& row, const planner::Problem& problem);

}  // namespace feeler::policies
