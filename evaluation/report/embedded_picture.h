#pragma once

#include <string>

namespace feeler::evaluation {

/// A PNG or JPEG as a data: URL. One above 400 kB is made smaller (JPEG, at most 1280 pixels wide). Empty if it cannot
/// be read.
std::string PictureDataUrl(const std::string& path);

}  // namespace feeler::evaluation
