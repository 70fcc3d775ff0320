#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kPriorsName = "priors";

/// How much of it is measured.
struct PriorsProtocol {
  int poses = 200;         ///< that make the table, and as many that judge the policies
  int installations = 10;  ///< of the camera, in each half
  int mountings = 10;      ///< of the camera, of the episodes
  int episodes = 5;        ///< of each mounting
  double gap = 1.15;       ///< certified ratio up to which policies are solved
};

/// What the camera's own distribution of errors is worth as a prior, from the calibration to episodes. A table is made
/// from one half of a calibration; each problem that it leads to is solved with equal weights and with the table's.
/// Both policies are compared by what the prior expects, over the held-out errors of the other half, and in episodes in
/// physics where the camera looks. Gains are of paired sums, with intervals from resampled installations.
ExperimentResult RunPriorsOf(const PriorsProtocol& protocol, const ExperimentRequest& request);
ExperimentResult RunPriors(const ExperimentRequest& request);

}  // namespace feeler::evaluation
