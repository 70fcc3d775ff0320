#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kGradedBoundsName = "graded-bounds";

/// How much of it is measured. Attempts end by expansions, so that all but the CPU times is the same everywhere.
struct GradedBoundsProtocol {
  std::string family;  ///< empty: the whole family of the task
  int strata = 5;      ///< of its sizes
  int per_stratum = 2;
  std::vector<double> shares = {0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0};  ///< of the certificates
  std::int64_t expansion_limit = 30'000;                             ///< of an attempt
};

/// Tables I and III over bounds of graded strength: shares of certificates, lines of hypotheses, the first contact. How
/// often RTDP-Bel at epsilon 1, 2, 3 and 5 has a policy, how much faster it and E-RTDP-Bel are than at 1, and naive
/// experience and a random order of problems against the paper's choices, all against how far the bound lies below the
/// optimum at the start. Says at which strength the printed values are met best.
ExperimentResult RunGradedBoundsOf(const GradedBoundsProtocol& protocol, const ExperimentRequest& request);
ExperimentResult RunGradedBounds(const ExperimentRequest& request);

}  // namespace feeler::evaluation
