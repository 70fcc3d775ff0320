#pragma once

#include <string>

#include "feeler/planner/noise/solve_noisy.h"

namespace feeler::policies {

/// The policy of a noisy problem as JSON (docs/file-formats.md): nodes with a move and the node that follows each
/// outcome (cycles may occur), or with the hypotheses declared, or with what gives up.
std::string FormatNoisyPolicy(const planner::NoisyProblem& noisy, const planner::NoisyResult& result,
                              const std::string& task);

}  // namespace feeler::policies
