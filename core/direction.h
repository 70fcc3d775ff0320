#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace feeler {

/// The six axis-aligned directions of a guarded move, in the frame of the target estimate.
enum class Direction : std::uint8_t { kPlusX, kMinusX, kPlusY, kMinusY, kPlusZ, kMinusZ };

inline constexpr int kDirectionCount = 6;
inline constexpr std::array<Direction, kDirectionCount> kDirections = {Direction::kPlusX, Direction::kMinusX,
                                                                       Direction::kPlusY, Direction::kMinusY,
                                                                       Direction::kPlusZ, Direction::kMinusZ};

/// 0, 1, 2 for x, y, z.
constexpr int AxisOf(Direction d) { return static_cast<int>(d) / 2; }
/// +1 or -1.
constexpr int SignOf(Direction d) { return static_cast<int>(d) % 2 == 0 ? 1 : -1; }
constexpr int IndexOf(Direction d) { return static_cast<int>(d); }
constexpr Direction Opposite(Direction d) { return static_cast<Direction>(static_cast<int>(d) ^ 1); }
constexpr Direction MakeDirection(int axis, int sign) { return static_cast<Direction>(2 * axis + (sign < 0 ? 1 : 0)); }

/// "+x", "-x", ...
std::string_view ToString(Direction d);
/// The direction of "+x", "-x", ...; empty when `text` is none of the six.
std::optional<Direction> ParseDirection(std::string_view text);

inline Eigen::Vector3i UnitCell(Direction d) {
  Eigen::Vector3i v = Eigen::Vector3i::Zero();
  v[AxisOf(d)] = SignOf(d);
  return v;
}
inline Eigen::Vector3d UnitVector(Direction d) { return UnitCell(d).cast<double>(); }

}  // namespace feeler
