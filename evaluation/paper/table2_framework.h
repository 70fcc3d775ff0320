#pragma once

#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kTable2FrameworkName = "table2-framework";

/// Table II: success and execution time of the whole framework, the target at random poses of the workspace that the
/// robot can serve (yaw included; draws that it cannot serve are rejected and counted), hypotheses of a size drawn from
/// the family of the task.
ExperimentResult RunTable2Framework(const ExperimentRequest& request);

}  // namespace feeler::evaluation
