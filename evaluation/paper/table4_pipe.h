#pragma once

#include "feeler/evaluation/harness/database_table.h"

namespace feeler::evaluation {

inline constexpr const char* kTable4PipeName = "table4-pipe";
ExperimentResult RunTable4Pipe(const ExperimentRequest& request);
/// Rows apart from the task, for tests.
DatabaseTable Table4Pipe();

}  // namespace feeler::evaluation
