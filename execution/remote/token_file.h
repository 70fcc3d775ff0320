#pragma once

#include <string>

namespace feeler::execution {

/// The token in a file: its first line, 1 to 200 printable characters. Empty for an empty path. Throws InputError; also
/// where others than the owner may read the file.
std::string ReadTokenFile(const std::string& path);

/// Throws InputError for a token that does not survive the numbers-only form: other than one to nine digits, the first
/// of them no zero. An empty one is none.
void RequireNumbersToken(const std::string& token);
/// A token as that form tells it: without leading zeros. Others as they are.
std::string AsNumber(const std::string& token);

}  // namespace feeler::execution
