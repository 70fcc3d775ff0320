#include "feeler/cad/readers/lines.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <system_error>

namespace feeler::cad {

bool Lines::Next(std::string& line) {
  line.clear();
  std::streambuf& bytes = *in_.rdbuf();
  int c = bytes.sbumpc();
  if (c == std::char_traits<char>::eof()) return false;
  for (; c != std::char_traits<char>::eof() && c != '\n' && c != '\r'; c = bytes.sbumpc())
    line.push_back(static_cast<char>(c));
  if (c == '\r' && bytes.sgetc() == '\n') bytes.sbumpc();
  ++number_;
  return true;
}

bool Lines::Read(std::span<char> bytes) {
  const auto wanted = static_cast<std::streamsize>(bytes.size());
  return in_.rdbuf()->sgetn(bytes.data(), wanted) == wanted;
}

std::string_view NextWord(std::string_view& rest) {
  const std::size_t begin = rest.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  rest.remove_prefix(begin);
  const std::string_view word = rest.substr(0, rest.find_first_of(" \t"));
  rest.remove_prefix(word.size());
  return word;
}

bool NextNumber(std::string_view& rest, double& value) {
  const std::size_t begin = rest.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return false;
  rest.remove_prefix(begin + (rest[begin] == '+' ? 1 : 0));
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc()) return false;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return true;
}

std::string Lower(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

}  // namespace feeler::cad
