#pragma once

#include "evaluation/experiments/database_table.h"

namespace feeler::evaluation {

inline constexpr const char* kTable3AblationName = "table3-ablation";
ExperimentResult RunTable3Ablation(const ExperimentRequest& request);
/// Rows and protocol apart from the task, for tests and other tasks.
DatabaseTable Table3Ablation();

}  // namespace feeler::evaluation
