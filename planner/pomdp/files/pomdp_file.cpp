#include "feeler/planner/pomdp/files/pomdp_file.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "feeler/core/error.h"

namespace feeler::planner {

Pomdp ReadPomdp(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw InputError(path, "no such file", "give a .pomdp or .pomdpx file");
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw InputError(path, "cannot be read", "check its permissions");
  const std::string name = std::filesystem::path(path).filename().string();
  std::string extension = std::filesystem::path(path).extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".pomdpx" ? ParsePomdpx(text, name) : ParseCassandraPomdp(text, name);
}

}  // namespace feeler::planner
