#include "feeler/env/vision/image.h"

#include <zlib.h>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"

namespace feeler::env {
namespace {

void AppendBigEndian(std::uint32_t value, std::string& bytes) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>((value >> shift) & 0xffU));
}

// Length, type, data, checksum of type and data (PNG specification, section 5.3).
void AppendChunk(const char* type, const std::string& data, std::string& png) {
  AppendBigEndian(static_cast<std::uint32_t>(data.size()), png);
  const std::string body = type + data;
  png += body;
  AppendBigEndian(
      static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()))),
      png);
}

}  // namespace

std::string EncodePng(const Image& image) {
  const auto row_bytes = 3 * static_cast<std::size_t>(image.width);
  if (image.width <= 0 || image.height <= 0 || image.rgb.size() != row_bytes * static_cast<std::size_t>(image.height)) {
    throw InputError("image", "empty or of a wrong size", "render it first");
  }
  // Each row is stored as the difference to the row above (filter 2), which compresses pictures well.
  std::string rows;
  rows.reserve((row_bytes + 1) * static_cast<std::size_t>(image.height));
  for (int row = 0; row < image.height; ++row) {
    rows.push_back(2);
    const std::uint8_t* now = image.at(row, 0);
    const std::uint8_t* above = row > 0 ? image.at(row - 1, 0) : nullptr;
    for (std::size_t i = 0; i < row_bytes; ++i) {
      rows.push_back(static_cast<char>(now[i] - (above != nullptr ? above[i] : 0)));
    }
  }
  uLongf size = compressBound(static_cast<uLong>(rows.size()));
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(rows.data()),
            static_cast<uLong>(rows.size()), 6);
  packed.resize(size);

  std::string header;
  AppendBigEndian(static_cast<std::uint32_t>(image.width), header);
  AppendBigEndian(static_cast<std::uint32_t>(image.height), header);
  header += {8, 2, 0, 0, 0};  // 8 bits, RGB, deflate, adaptive filters, not interlaced
  std::string png = "\x89PNG\r\n\x1a\n";
  AppendChunk("IHDR", header, png);
  AppendChunk("IDAT", packed, png);
  AppendChunk("IEND", "", png);
  return png;
}

void WritePng(const Image& image, const std::string& path) { WriteFileAtomically(path, EncodePng(image)); }

}  // namespace feeler::env
