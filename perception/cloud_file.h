#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "feeler/perception/point_cloud.h"

namespace feeler::perception {

/// Reads the points of a PLY file (ascii, binary little and big endian) or a PCD file (ascii, binary and
/// binary_compressed); which of them it is the first line says that is neither blank nor a comment, a byte order mark
/// before it is passed over. In a text every point is one line, of as many numbers as the header says. Other elements
/// and fields are skipped, points that are not finite are left out. A VIEWPOINT other than the identity is not applied;
/// `notes`, if given, then gains a line that says so.
///
/// Throws InputError, naming `where`, for what is neither (an OBJ or STL mesh by its name), is malformed (with the
/// line) or cut off, holds no finite point, or is not in metres: coordinates of typically more than 50 are taken for
/// millimetres.
Points ParseCloud(std::string_view bytes, const std::string& where, std::vector<std::string>* notes = nullptr);

/// ParseCloud of a file.
Points ReadCloud(const std::string& path, std::vector<std::string>* notes = nullptr);

}  // namespace feeler::perception
