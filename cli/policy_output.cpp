#include "feeler/cli/policy_output.h"

#include <iostream>

#include "feeler/core/file_output.h"
#include "feeler/policies/io/policy_json.h"

namespace feeler::cli {

void WritePolicy(const planner::Problem& problem, const planner::PolicyGraph& policy, const std::string& name,
                 const std::string& path) {
  const std::string text = policies::FormatPolicyFile(policies::ToPolicyFile(problem, policy, name));
  if (path.empty()) {
    std::cout << text;
  } else {
    WriteFileAtomically(path, text);
  }
}

}  // namespace feeler::cli
