#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kBaselinesName = "baselines";

/// All policies over the same episodes and sockets in physics, as the uncertainty grows from 4 mm to 3 cm along every
/// axis: success, seconds, path, force; and where a baseline wins.
ExperimentResult RunBaselines(const ExperimentRequest& request);

}  // namespace feeler::evaluation
