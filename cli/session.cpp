#include "feeler/cli/session.h"

#include <unistd.h>

#include <filesystem>
#include <iostream>

#include "feeler/core/error.h"

namespace feeler::cli {

void PrintJson(const nlohmann::json& value) { std::cout << value.dump(2) << "\n"; }

void RequireWritable(const std::string& option, const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path target(path);
  if (path.empty()) throw InputError(option, "empty file name", "give a file to write");
  if (fs::is_directory(target)) throw InputError(option, path + " is a directory", "give a file to write");
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!fs::is_directory(folder)) {
    throw InputError(option, "the folder " + folder.string() + " does not exist", "create it first");
  }
  const std::string probe = fs::exists(target) ? target.string() : folder.string();
  if (access(probe.c_str(), W_OK) != 0) {
    throw InputError(option, "cannot write " + path, "choose a place where you may write");
  }
}

}  // namespace feeler::cli
