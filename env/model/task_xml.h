#pragma once

#include <filesystem>
#include <string>

namespace feeler::env {

/// An MJCF text with every <include> replaced by the children of the included file's root (paths relative to `folder`,
/// the folder of the main file, as MuJoCo takes them) and every file name of an asset made absolute.
/// `name` stands for the main file in messages. Throws InputError for malformed XML, a missing file or a file that is
/// included twice.
std::string ResolveMjcf(const std::string& mjcf, const std::string& name, const std::filesystem::path& folder);

/// The whole file as text. Throws InputError naming the file.
std::string ReadTextFile(const std::filesystem::path& file);

}  // namespace feeler::env
