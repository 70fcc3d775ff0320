#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kSpiralTuningName = "spiral-tuning";

/// Pitch, speed and force of the spiral search, per socket: success and seconds of every combination over the same
/// episodes. The best of a socket is what `spiral` uses there (workflow::TunedSpiral).
ExperimentResult RunSpiralTuning(const ExperimentRequest& request);

}  // namespace feeler::evaluation
