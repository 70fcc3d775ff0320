#pragma once

#include "feeler/evaluation/harness/database_table.h"

namespace feeler::evaluation {

inline constexpr const char* kTable3AblationName = "table3-ablation";
ExperimentResult RunTable3Ablation(const ExperimentRequest& request);
/// Rows and protocol apart from the task, for tests and other tasks.
DatabaseTable Table3Ablation();
/// The same with the bound that seeds experience in 4-D, for tasks with uncertain orientations.
DatabaseTable Table3AblationWithOrientations();

}  // namespace feeler::evaluation
