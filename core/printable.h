#pragma once

#include <string>

namespace feeler {

/// `text` as it can be shown on one line: control characters (ESC and NUL among them) and bytes that are not UTF-8 as
/// \xNN, blanks for line ends and tabs, and, where it is longer than `most` bytes, its middle left out.
std::string Printable(const std::string& text, std::size_t most = std::string::npos);

}  // namespace feeler
