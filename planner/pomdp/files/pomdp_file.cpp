#include "feeler/planner/pomdp/files/pomdp_file.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {

Pomdp ReadPomdp(const std::string& path, const std::function<bool()>& stop) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw InputError(path, "no such file", "give a .pomdp or .pomdpx file");
  std::ifstream file(path, std::ios::binary);
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  Pulse pulse(stop);
  std::string text;
  for (std::vector<char> piece(kPiece); file;) {
    file.read(piece.data(), static_cast<std::streamsize>(kPiece));
    text.append(piece.data(), static_cast<std::size_t>(file.gcount()));
    pulse(kPiece);
  }
  if (!file.eof()) throw InputError(path, "cannot be read", "check its permissions");
  const std::string name = std::filesystem::path(path).filename().string();
  std::string extension = std::filesystem::path(path).extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".pomdpx" ? ParsePomdpx(text, name, stop) : ParseCassandraPomdp(text, name, stop);
}

}  // namespace feeler::planner
