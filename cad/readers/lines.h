#pragma once

#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

namespace feeler::cad {

/// The lines of a text file, whether they end as on Unix, Windows or an old Macintosh.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& file) : in_(file, std::ios::binary) {}
  /// The next line, without its end; false after the last.
  bool Next(std::string& line);
  /// The bytes behind it; false if there are fewer.
  bool Read(std::span<char> bytes);
  int number() const { return number_; }  ///< of the line that was read last, from 1

 private:
  std::ifstream in_;
  int number_ = 0;
};

/// The next word of a line, which is taken from it; empty at its end.
std::string_view NextWord(std::string_view& rest);
/// The next number of a line; false at its end. Locales play no part.
bool NextNumber(std::string_view& rest, double& value);
std::string Lower(std::string_view text);

}  // namespace feeler::cad
