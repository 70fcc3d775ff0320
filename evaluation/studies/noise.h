#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kNoiseName = "noise";

/// Noise of the force sensor, friction and stiffness of the joints, and a turned target, each growing alone: what
/// breaks first, of the database policy with and without fallbacks and of baselines.
ExperimentResult RunNoise(const ExperimentRequest& request);

}  // namespace feeler::evaluation
