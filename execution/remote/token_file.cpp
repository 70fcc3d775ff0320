#include "feeler/execution/remote/token_file.h"

#include <sys/stat.h>

#include <algorithm>
#include <fstream>

#include "feeler/core/error.h"

namespace feeler::execution {

std::string ReadTokenFile(const std::string& path) {
  if (path.empty()) return "";
  constexpr std::size_t kMost = 200;
  struct stat status {};
  std::ifstream in(path);
  std::string token;
  if (stat(path.c_str(), &status) != 0 || !in) throw InputError(path, "cannot be read", "give a file with the token");
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0 && S_ISREG(status.st_mode)) {
    throw InputError(path, "others may read the token", "chmod 600 it");
  }
  for (char c = 0; token.size() <= kMost && in.get(c) && c != '\n';) token += c;  // a device may never end a line
  const bool printable = std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (token.empty() || token.size() > kMost || !printable) {
    throw InputError(path, "its first line is no token", "write 1 to 200 letters and digits, without blanks");
  }
  return token;
}

void RequireNumbersToken(const std::string& token) {
  constexpr std::size_t kMostDigits = 9;
  if (token.empty()) return;
  if (token.size() > kMostDigits || token.find_first_not_of("0123456789") != std::string::npos) {
    throw InputError("--token-file", "the numbers-only form carries one to nine digits",
                     "choose such a token at both ends");
  }
  if (token.front() == '0') {
    throw InputError("--token-file", "the token begins with a zero, which the numbers-only form loses",
                     "choose one that begins with 1 to 9, at both ends");
  }
}

std::string AsNumber(const std::string& token) {
  if (token.empty() || token.find_first_not_of("0123456789") != std::string::npos) return token;
  return token.substr(std::min(token.find_first_not_of('0'), token.size() - 1));
}

}  // namespace feeler::execution
