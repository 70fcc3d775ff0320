#include "cli/policy_output.h"

#include <iostream>

#include "evaluation/experiment_output.h"
#include "policies/formats/policy_json.h"

namespace feeler::cli {

void WritePolicy(const planner::Problem& problem, const planner::Policy& policy, const std::string& name,
                 const std::string& path) {
  const std::string text = policies::FormatPolicyFile(policies::ToPolicyFile(problem, policy, name));
  if (path.empty()) {
    std::cout << text;
  } else {
    evaluation::WriteFileAtomically(path, text);
  }
}

}  // namespace feeler::cli
