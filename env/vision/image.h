#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace feeler::env {

/// 8-bit RGB, rows from the top, `rgb.size() = 3 * width * height`.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
  const std::uint8_t* at(int row, int column) const {
    return rgb.data() +
           3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column));
  }
};

/// Distance along the optical axis in metres, rows from the top.
struct DepthImage {
  int width = 0;
  int height = 0;
  std::vector<float> depth_m;
  float at(int row, int column) const {
    return depth_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column)];
  }
};

/// Writes a PNG file (RGB, 8 bit), by way of a temporary name: the file is complete or not there.
/// Throws InputError when it cannot be written or the image is empty.
void WritePng(const Image& image, const std::string& path);

/// The bytes of a PNG file.
std::string EncodePng(const Image& image);

}  // namespace feeler::env
