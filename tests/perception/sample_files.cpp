#include "tests/perception/sample_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

namespace feeler::perception {
namespace {

template <class T>
void Append(T value, bool big_endian, std::string& bytes) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (big_endian) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

}  // namespace

Points SamplePoints() {
  Points points;
  for (int i = 0; i < 12; ++i) points.emplace_back(0.5 + 0.125 * i, -0.25 * i, 0.0625 * i * i);
  return points;
}

std::string AsciiPly(const Points& points) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment made by a test\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n",
      points.size() + 1);
  for (const Eigen::Vector3d& p : points) text += fmt::format("{} {} {} 255\n", p.x(), p.y(), p.z());
  return text + "nan 0 0 255\n3 0 1 2\n";
}

std::string BinaryPly(const Points& points, bool big_endian) {
  std::string bytes = fmt::format(
      "ply\nformat binary_{}_endian 1.0\nelement patch 2\nproperty list uchar short ids\nelement vertex {}\n"
      "property double x\nproperty ushort quality\nproperty double y\nproperty double z\nend_header\n",
      big_endian ? "big" : "little", points.size() + 1);
  for (int patch = 0; patch < 2; ++patch) {
    Append<std::uint8_t>(2, big_endian, bytes);
    Append<std::int16_t>(-5, big_endian, bytes);
    Append<std::int16_t>(7, big_endian, bytes);
  }
  const auto vertex = [&](double x, double y, double z) {
    Append(x, big_endian, bytes);
    Append<std::uint16_t>(9, big_endian, bytes);
    Append(y, big_endian, bytes);
    Append(z, big_endian, bytes);
  };
  for (const Eigen::Vector3d& p : points) vertex(p.x(), p.y(), p.z());
  vertex(0.0, std::numeric_limits<double>::quiet_NaN(), 0.0);
  return bytes;
}

std::string AsciiPcd(const Points& points) {
  std::string text = fmt::format(
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH {0}\nHEIGHT "
      "1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA ascii\n",
      points.size() + 1);
  for (const Eigen::Vector3d& p : points) text += fmt::format("{} {} {} 1\n", p.x(), p.y(), p.z());
  return text + "nan nan nan 0\n";
}

std::string BinaryPcd(const Points& points) {
  std::string bytes = fmt::format(
      "VERSION 0.7\nFIELDS x y normal z\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 3 1\nWIDTH {0}\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      points.size() + 1);
  const auto point = [&](double x, double y, double z) {
    for (const double value : {x, y, 0.0, 0.0, 1.0, z}) Append(static_cast<float>(value), false, bytes);
  };
  for (const Eigen::Vector3d& p : points) point(p.x(), p.y(), p.z());
  point(0.0, 0.0, std::numeric_limits<double>::infinity());
  return bytes;
}

CameraIntrinsics SampleCamera(int width, int height) {
  CameraIntrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.8 * width;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  camera.world_T_camera = MakePose({1.0, 0.5, 0.8}, Eigen::Quaterniond(0.6, 0.0, 0.8, 0.0));
  return camera;
}

}  // namespace feeler::perception
