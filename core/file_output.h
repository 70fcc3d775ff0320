#pragma once

#include <string>
#include <string_view>

namespace feeler {

/// Replaces the file at `path` whole or not at all. Throws InputError if it cannot be written.
void WriteFileAtomically(const std::string& path, std::string_view content);

}  // namespace feeler
