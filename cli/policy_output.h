#pragma once

#include <string>

#include "feeler/cli/common/console.h"
#include "feeler/core/file_output.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/planner/policy/policy_graph.h"
#include "feeler/policies/io/policy_json.h"

namespace feeler::cli {

/// Writes the policy file of a task or problem called `name` (docs/file-formats.md) to `path`, or to stdout if it is
/// empty.
inline void WritePolicy(const planner::Problem& problem, const planner::PolicyGraph& policy, const std::string& name,
                        const std::string& path) {
  const std::string text = policies::FormatPolicyFile(policies::ToPolicyFile(problem, policy, name));
  if (path.empty()) {
    PrintResult(text);
  } else {
    WriteFileAtomically(path, text);
  }
}

}  // namespace feeler::cli
