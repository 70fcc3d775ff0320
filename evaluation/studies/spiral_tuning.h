#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kSpiralTuningName = "spiral-tuning";

/// Pitch, speed and force of the spiral search, per socket: success and seconds of every combination over the same
/// episodes. workflow::DerivedSpiral was taken from it.
ExperimentResult RunSpiralTuning(const ExperimentRequest& request);

}  // namespace feeler::evaluation
