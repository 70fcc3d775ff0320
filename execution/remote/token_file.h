#pragma once

#include <string>

namespace feeler::execution {

/// The token in a file: its first line, 1 to 200 printable characters. Empty for an empty path. Throws InputError; also
/// where others than the owner may read the file.
std::string ReadTokenFile(const std::string& path);

}  // namespace feeler::execution
