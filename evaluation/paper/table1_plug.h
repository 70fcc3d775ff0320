#pragma once

#include "feeler/evaluation/harness/database_table.h"

namespace feeler::evaluation {

inline constexpr const char* kTable1PlugName = "table1-plug";
ExperimentResult RunTable1Plug(const ExperimentRequest& request);
/// Rows and protocol apart from the task, for tests and other tasks.
DatabaseTable Table1Plug();

}  // namespace feeler::evaluation
