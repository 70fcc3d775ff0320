#pragma once

#include <string>

#include "feeler/planner/belief/problem.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::cli {

/// Writes the policy file of a task or problem called `name` (docs/file-formats.md) to `path`, or to stdout if it is
/// empty.
void WritePolicy(const planner::Problem& problem, const planner::PolicyGraph& policy, const std::string& name,
                 const std::string& path);

}  // namespace feeler::cli
