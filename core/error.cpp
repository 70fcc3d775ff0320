#include "feeler/core/error.h"

namespace feeler {
namespace {

std::string OneLine(const std::string& where, const std::string& what, const std::string& mend) {
  std::string line = where + ": " + what;
  if (!mend.empty()) line += " (" + mend + ")";
  for (char& c : line) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  return line;
}

}  // namespace

Error::Error(const std::string& where, const std::string& what, const std::string& mend)
    : std::runtime_error(OneLine(where, what, mend)) {}

}  // namespace feeler
