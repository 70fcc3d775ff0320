#include "feeler/perception/input_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "feeler/core/error.h"

namespace feeler::perception {
namespace {

const nlohmann::json& At(const nlohmann::json& object, const char* key, const std::string& where) {
  if (!object.is_object() || !object.contains(key)) {
    throw InputError(where, fmt::format("'{}' is missing", key), "see docs/file-formats.md");
  }
  return object.at(key);
}

double Number(const nlohmann::json& value, const char* key, double least, double most, const std::string& where) {
  if (value.is_number()) {
    const auto number = value.get<double>();
    if (std::isfinite(number) && number >= least && number <= most) return number;
  }
  throw InputError(where, fmt::format("'{}' is not a number from {} to {}", key, least, most),
                   "see docs/file-formats.md");
}

Eigen::VectorXd List(const nlohmann::json& object, const char* key, std::size_t size, const std::string& where) {
  const nlohmann::json& list = At(object, key, where);
  if (!list.is_array() || list.size() != size) {
    throw InputError(where, fmt::format("'{}' is not a list of {} numbers", key, size), "see docs/file-formats.md");
  }
  Eigen::VectorXd values(static_cast<Eigen::Index>(size));
  for (std::size_t i = 0; i < size; ++i) {
    values[static_cast<Eigen::Index>(i)] = Number(list[i], key, -1e6, 1e6, where);
  }
  return values;
}

}  // namespace

std::string ReadFile(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError(path, "is a folder", "give a file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path, "cannot be read", "check the name and the permissions");
  const auto size = std::filesystem::file_size(path, error);
  if (!error && size > kLargestFile) {
    throw InputError(path, fmt::format("has {} bytes", size), fmt::format("give at most {}", kLargestFile));
  }
  std::string bytes;  // read to the end, at most to the limit: a device or pipe has no size of its own
  std::array<char, 65536> chunk{};
  while (in.read(chunk.data(), chunk.size()) || in.gcount() > 0) {
    bytes.append(chunk.data(), static_cast<std::size_t>(in.gcount()));
    if (bytes.size() > kLargestFile) {
      throw InputError(path, "does not end", fmt::format("give at most {} bytes", kLargestFile));
    }
  }
  return bytes;
}

nlohmann::json ParseJson(std::string_view text, const std::string& where) {
  constexpr int kDeepest = 16;
  // The library's parser recurses into nothing here: the callback refuses what is nested too deep.
  const auto shallow = [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
    if (depth > kDeepest) throw InputError(where, "nested too deep", "see docs/file-formats.md");
    return true;
  };
  try {
    return nlohmann::json::parse(text.begin(), text.end(), shallow);
  } catch (const nlohmann::json::exception& e) {
    throw InputError(where, fmt::format("is not JSON: {}", e.what()), "see docs/file-formats.md");
  }
}

double NumberAt(const nlohmann::json& object, const char* key, double least, double most, const std::string& where) {
  return Number(At(object, key, where), key, least, most, where);
}

int IntegerAt(const nlohmann::json& object, const char* key, int least, int most, const std::string& where) {
  const nlohmann::json& value = At(object, key, where);
  if (!value.is_number_integer()) {
    throw InputError(where, fmt::format("'{}' is not a whole number", key), "see docs/file-formats.md");
  }
  return static_cast<int>(Number(value, key, least, most, where));
}

std::string TextAt(const nlohmann::json& object, const char* key, const std::string& where) {
  const nlohmann::json& value = At(object, key, where);
  if (!value.is_string()) throw InputError(where, fmt::format("'{}' is not a text", key), "see docs/file-formats.md");
  return value.get<std::string>();
}

Eigen::Vector3d VectorAt(const nlohmann::json& object, const char* key, const std::string& where) {
  return List(object, key, 3, where);
}

Pose PoseAt(const nlohmann::json& object, const char* key, const std::string& where) {
  const nlohmann::json& pose = At(object, key, where);
  const std::string inside = where + ", " + key;
  const Eigen::Vector3d position = VectorAt(pose, "position_m", inside);
  const Eigen::VectorXd q = List(pose, "quaternion_wxyz", 4, inside);
  if (std::abs(q.norm() - 1.0) > 0.01) {
    throw InputError(inside, "the quaternion has not the length 1", "give (w, x, y, z) of a rotation");
  }
  return MakePose(position, Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
}

nlohmann::ordered_json PoseJson(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d& p = pose.translation();
  return {{"position_m", {p.x(), p.y(), p.z()}}, {"quaternion_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

}  // namespace feeler::perception
