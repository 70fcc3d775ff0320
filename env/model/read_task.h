#pragma once

#include <filesystem>
#include <string>

#include "feeler/env/model/task_file.h"

namespace feeler::env {

/// LoadTask without asking whether numbers and geometry agree (env/model/geometry_findings.h): `turns_freely` is not
/// set. Throws InputError where the file cannot be read as a task.
TaskModel ReadTask(const std::string& task);
/// The same from a text, as LoadTaskFromText.
TaskModel ReadTaskFromText(const std::string& mjcf, const std::string& name, const std::filesystem::path& folder = ".");

}  // namespace feeler::env
