#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace feeler::env {

/// An MJCF text with every <include> replaced by the children of the included file's root (paths relative to `folder`,
/// the folder of the main file, as MuJoCo takes them) and every file name of an asset made absolute.
/// `name` stands for the main file in messages. Throws InputError for malformed XML, a missing file or a file that is
/// included twice.
std::string ResolveMjcf(const std::string& mjcf, const std::string& name, const std::filesystem::path& folder);

/// The whole file as text. Throws InputError naming the file.
std::string ReadTextFile(const std::filesystem::path& file);

/// The file of a task given by name or path, with a folder before its name. It need not exist.
std::filesystem::path FileOfTask(const std::string& task);

/// The files that a task (name or path) is read from: its own, what that includes, meshes, height fields and textures.
/// Throws InputError where the MJCF cannot be read.
std::vector<std::string> FilesOfTask(const std::string& task);

/// The same of an MJCF text, without its own file. Throws as ResolveMjcf.
std::vector<std::string> FilesOfMjcf(const std::string& mjcf, const std::string& name,
                                     const std::filesystem::path& folder);

}  // namespace feeler::env
