#pragma once

#include <cstdint>
#include <filesystem>

#include "feeler/cad/readers/read_part.h"

namespace feeler::cad {

/// STL, ascii or binary, whatever the header calls it. Of an ascii file every `solid` is a body. Throws InputError with
/// the cause for a file that is empty, cut short, or neither.
RawPart ReadStl(const std::filesystem::path& file);

/// How many triangles it holds, about, without reading them into memory; counts no further than `most` + 1.
std::int64_t CountStl(const std::filesystem::path& file, std::int64_t most);

}  // namespace feeler::cad
