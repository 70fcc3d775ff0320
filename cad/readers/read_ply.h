#pragma once

#include <filesystem>

#include "feeler/cad/readers/read_part.h"

namespace feeler::cad {

/// PLY, ascii or binary of either byte order: the vertices and faces of one body; other elements and properties are
/// passed over. Throws InputError with the place for a header that is none or promises more than the file has bytes,
/// for rows that are not as it says, and for a file that is cut short.
RawPart ReadPly(const std::filesystem::path& file);

}  // namespace feeler::cad
