#include "feeler/perception/depth_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "feeler/core/captured_stderr.h"
#include "feeler/core/error.h"

namespace feeler::perception {
namespace {

constexpr char kSignature[] = "\x89PNG\r\n\x1a\n";

std::uint32_t BigEndian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

std::uint32_t Crc(std::string_view bytes) {
  static const std::array<std::uint32_t, 256> kTable = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t c = i;
      for (int bit = 0; bit < 8; ++bit) c = (c & 1) != 0 ? 0xEDB88320U ^ (c >> 1) : c >> 1;
      table[i] = c;
    }
    return table;
  }();
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char c : bytes) crc = kTable[(crc ^ static_cast<unsigned char>(c)) & 0xFF] ^ (crc >> 8);
  return crc ^ 0xFFFFFFFFU;
}

struct PngHeader {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  int bits = 0;
  int color = 0;
};

/// Walks the chunks before the decoder sees them: libpng reports damage on stderr, and we say it ourselves.
PngHeader CheckPng(std::string_view bytes, const std::string& where) {
  const auto damaged = [&](const std::string& what) -> InputError {
    return {where, what, "give a whole 16-bit grey PNG"};
  };
  if (bytes.substr(0, 8) != std::string_view(kSignature, 8)) throw damaged("is not a PNG file");
  PngHeader header;
  bool data = false;
  for (std::size_t at = 8;;) {
    if (bytes.size() - at < 12) throw damaged("is cut off");
    const std::uint32_t length = BigEndian(bytes, at);
    if (length > bytes.size() - at - 12) throw damaged("is cut off");
    const std::string_view type = bytes.substr(at + 4, 4);
    if (Crc(bytes.substr(at + 4, length + 4)) != BigEndian(bytes, at + 8 + length)) throw damaged("is damaged");
    if (at == 8) {
      if (type != "IHDR" || length != 13) throw damaged("has no header");
      header = {BigEndian(bytes, 16), BigEndian(bytes, 20), static_cast<unsigned char>(bytes[24]),
                static_cast<unsigned char>(bytes[25])};
    }
    if (type == "IDAT") data = true;
    if (type == "IEND") break;
    at += 12 + length;
  }
  if (!data) throw damaged("holds no picture");
  return header;
}

struct DepthUnit {
  double scale_m;
  const char* name;
};
constexpr std::array<DepthUnit, 7> kDepthUnits{{{1e-3, "0.001 (millimetres)"},
                                                {2e-4, "0.0002 (5000 a metre, as the data sets of TUM)"},
                                                {2.5e-4, "0.00025 (quarters of a millimetre, as RealSense L515)"},
                                                {1.25e-4, "0.000125 (eighths of a millimetre)"},
                                                {1e-4, "0.0001 (tenths of a millimetre)"},
                                                {1e-2, "0.01 (centimetres)"},
                                                {1e-5, "0.00001 (hundredths of a millimetre)"}}};

/// The units that would put `seen_m` within a factor `near` of `expected_m`, best first.
std::string FittingUnits(double seen_m, double expected_m, double near, double depth_scale_m) {
  std::vector<std::pair<double, const char*>> fitting;
  for (const DepthUnit& unit : kDepthUnits) {
    const double off = std::abs(std::log(seen_m / depth_scale_m * unit.scale_m / expected_m));
    if (off < std::log(near)) fitting.emplace_back(off, unit.name);
  }
  std::sort(fitting.begin(), fitting.end());
  std::string names;
  for (const auto& [off, name] : fitting) names += (names.empty() ? "" : " or ") + std::string(name);
  return names;
}

}  // namespace

std::string GuessDepthUnit(const DepthFrame& frame, const CameraIntrinsics& camera, const Eigen::Vector3d& expected_m) {
  constexpr double kRight = 1.8;  // between target and bench, or where the target may be
  const Eigen::Vector3d p = camera.world_T_camera.inverse() * expected_m;
  if (!(p.z() > 0.0)) return "";
  const double column = camera.fx * p.x() / p.z() + camera.cx;
  const double row = camera.fy * p.y() / p.z() + camera.cy;
  const int half = std::max(2, camera.width / 16);
  std::vector<float> depths;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      if (std::abs(u - column) > half || std::abs(v - row) > half) continue;
      const float depth = frame.depth_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(frame.width) +
                                        static_cast<std::size_t>(u)];
      if (depth > 0.0F) depths.push_back(depth);
    }
  }
  if (depths.empty()) return "";
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  if (std::abs(std::log(*middle / p.z())) < std::log(kRight)) return "";
  const std::string units = FittingUnits(*middle, p.z(), 1.4, camera.depth_scale_m);
  return fmt::format("; the picture is {:.3g} m deep where the target is expected at {:.3g} m: depth_scale_m {:g} {}",
                     *middle, p.z(), camera.depth_scale_m, units.empty() ? "may be wrong" : "may have to be " + units);
}

DepthFrame ParseDepthPng(std::string_view bytes, const CameraIntrinsics& camera, const std::string& where) {
  const PngHeader header = CheckPng(bytes, where);
  if (header.bits != 16 || header.color != 0) {
    throw InputError(where,
                     fmt::format("is not a 16-bit grey PNG ({} bits, colour type {})", header.bits, header.color),
                     "write depths as 16-bit grey");
  }
  if (header.width != static_cast<std::uint32_t>(camera.width) ||
      header.height != static_cast<std::uint32_t>(camera.height)) {
    throw InputError(
        where,
        fmt::format("has {} x {} pixels, the camera {} x {}", header.width, header.height, camera.width, camera.height),
        "give the intrinsics of this image");
  }
  cv::Mat image;
  std::string complaint;  // of libpng
  try {
    const CapturedStderr captured;
    const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
    image = cv::imdecode(encoded, cv::IMREAD_UNCHANGED);
    complaint = captured.LastLine();
  } catch (const cv::Exception&) {
    image = cv::Mat();
  }
  if (image.empty() || image.type() != CV_16UC1 || image.cols != camera.width || image.rows != camera.height) {
    throw InputError(where, "is damaged" + (complaint.empty() ? "" : ": " + complaint), "give a whole 16-bit grey PNG");
  }
  DepthFrame frame{camera.width, camera.height, {}};
  frame.depth_m.reserve(static_cast<std::size_t>(image.total()));
  float nearest = INFINITY;
  float farthest = 0.0F;
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const auto depth = static_cast<float>(image.at<std::uint16_t>(row, column) * camera.depth_scale_m);
      frame.depth_m.push_back(depth);
      if (depth == 0.0F) continue;
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
    }
  }
  if (farthest > 0.0F && (farthest < 0.02F || nearest > 50.0F)) {
    constexpr double kUsual_m = 1.0;  // of a camera over a table: a third to three metres
    const std::string units = FittingUnits(std::sqrt(nearest * farthest), kUsual_m, 3.0, camera.depth_scale_m);
    throw InputError(
        where, fmt::format("depths from {:.4g} to {:.4g} m", nearest, farthest),
        "set depth_scale_m of the intrinsics to the metres per unit" + (units.empty() ? "" : ": it may be " + units));
  }
  return frame;
}

std::string EncodeDepthPng(const DepthFrame& frame, double depth_scale_m) {
  if (frame.depth_m.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height) ||
      frame.depth_m.empty()) {
    throw InputError("depth image", "is empty", "give an image with pixels");
  }
  cv::Mat image(frame.height, frame.width, CV_16UC1);
  for (int row = 0; row < frame.height; ++row) {
    for (int column = 0; column < frame.width; ++column) {
      const double units = std::round(
          static_cast<double>(frame.depth_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) +
                                            static_cast<std::size_t>(column)]) /
          depth_scale_m);
      image.at<std::uint16_t>(row, column) =
          units > 0.0 && units <= 65535.0 ? static_cast<std::uint16_t>(units) : std::uint16_t{0};
    }
  }
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes);
  return {bytes.begin(), bytes.end()};
}

}  // namespace feeler::perception
