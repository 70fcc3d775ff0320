#pragma once

#include <string>

#include "feeler/core/task.h"
#include "feeler/planner/family/problem_family.h"

namespace feeler::policies {

/// Reads a problem family from a JSON file (docs/file-formats.md): `{"problems": ["2..5x2..5x3", "7x7x7"]}`. Problems
/// that are named more than once count once. Throws InputError naming file and field.
planner::ProblemFamily ReadProblemFamily(const std::string& path, const Task& task);

}  // namespace feeler::policies
