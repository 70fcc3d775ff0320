#pragma once

#include <string>
#include <string_view>

#include "feeler/perception/point_cloud.h"

namespace feeler::perception {

/// Reads the points of a PLY file (ascii, binary little and big endian) or a PCD file (ascii and binary); which of them
/// it is its first bytes say. Other elements and fields are skipped, points that are not finite are left out.
///
/// Throws InputError, naming `where`, for what is neither, is malformed or cut off, holds no finite point, is
/// compressed (`binary_compressed` PCD), or is not in metres: coordinates of typically more than 50 are taken for
/// millimetres.
Points ParseCloud(std::string_view bytes, const std::string& where);

/// ParseCloud of a file.
Points ReadCloud(const std::string& path);

}  // namespace feeler::perception
