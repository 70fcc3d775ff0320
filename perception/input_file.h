#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "feeler/core/pose.h"

namespace feeler::perception {

/// Largest file that is read, bytes.
inline constexpr std::size_t kLargestFile = std::size_t{1} << 28;

/// The file's bytes. Throws InputError if it cannot be read or is larger than kLargestFile.
std::string ReadFile(const std::string& path);

/// Parses JSON; the nesting is limited. Throws InputError naming `where`.
nlohmann::json ParseJson(std::string_view text, const std::string& where);

/// Members of a JSON object, checked; all throw InputError naming `where` and the key.
double NumberAt(const nlohmann::json& object, const char* key, double least, double most, const std::string& where);
int IntegerAt(const nlohmann::json& object, const char* key, int least, int most, const std::string& where);
std::string TextAt(const nlohmann::json& object, const char* key, const std::string& where);
/// `{"position_m": [x, y, z], "quaternion_wxyz": [w, x, y, z]}`
Pose PoseAt(const nlohmann::json& object, const char* key, const std::string& where);
Eigen::Vector3d VectorAt(const nlohmann::json& object, const char* key, const std::string& where);
nlohmann::ordered_json PoseJson(const Pose& pose);

}  // namespace feeler::perception
