#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kPerceptionName = "perception";

/// Registration and uncertainty table of the plug over the workspace: errors against distance, held-out joint
/// coverage and number of hypotheses, with and without the bias taken out; pictures of the camera's view, the
/// registered model in the cloud and the box of hypotheses. Quick: 80 poses for the table and as many to judge it, else
/// 1000.
ExperimentResult RunPerception(const ExperimentRequest& request);

}  // namespace feeler::evaluation
