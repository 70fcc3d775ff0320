#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// A contact map as bytes, with a checksum: docs/file-formats.md.
std::string EncodeContactMap(const ContactMap& map);
/// Throws InputError (`where` and what is wrong) when the bytes are of another version or damaged.
ContactMap DecodeContactMap(std::string_view bytes, const std::string& where);

/// Replaces the file whole or not at all, and makes its folder. Throws InputError when it cannot be written.
void WriteContactMap(const std::filesystem::path& file, const ContactMap& map);
/// Throws InputError when the file is missing, of another version or damaged.
ContactMap ReadContactMap(const std::filesystem::path& file);

}  // namespace feeler::planner
