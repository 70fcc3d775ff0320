#pragma once

#include <cstdint>
#include <filesystem>

#include "feeler/cad/readers/read_part.h"

namespace feeler::cad {

/// OBJ: every face of every group and object; each of those is a body. Polygons are cut into triangles, those that are
/// not convex by their ears. (assimp's reader drops faces of degenerate groups; the format is a page long.)
RawPart ReadObj(const std::filesystem::path& file);

/// How many faces it holds, without reading them into memory; counts no further than `most` + 1.
std::int64_t CountObj(const std::filesystem::path& file, std::int64_t most);

}  // namespace feeler::cad
