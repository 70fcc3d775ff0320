#pragma once

#include <string>
#include <utility>
#include <vector>

#include "feeler/evaluation/harness/database_table.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::evaluation {

inline constexpr const char* kNoisePriceName = "noise-price";

/// What noise in the readings costs: the certified policy that knows of it, and the policy that does not, carried out
/// exactly in the noisy world. The problems are a slot in a wall and the plug at several extents.
ExperimentResult RunNoisePrice(const ExperimentRequest& request);

struct NoisePriceProtocol {
  std::vector<double> levels = {0.0, 0.005, 0.01, 0.02, 0.05};  ///< of each kind of noise, the others 0
  double gap = 1.05;
  std::int64_t expansion_limit = 3000;  ///< of a problem with noise
};

/// The same on given problems, by name.
ExperimentResult RunNoisePriceOn(const std::vector<std::pair<std::string, planner::Problem>>& problems,
                                 const NoisePriceProtocol& protocol, const ExperimentRequest& request);

}  // namespace feeler::evaluation
