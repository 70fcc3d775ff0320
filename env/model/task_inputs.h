#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace feeler::env {

/// The file of a task given by name or path, with a folder before its name. It need not exist.
std::filesystem::path FileOfTask(const std::string& task);

/// The files that a task (name or path) is read from: its own, what that includes, meshes, height fields and textures.
/// Throws InputError where the MJCF cannot be read.
std::vector<std::string> FilesOfTask(const std::string& task);

/// The same of an MJCF text, without its own file. Throws as ResolveMjcf (env/model/task_xml.h).
std::vector<std::string> FilesOfMjcf(const std::string& mjcf, const std::string& name,
                                     const std::filesystem::path& folder);

}  // namespace feeler::env
