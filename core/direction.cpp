#include "feeler/core/direction.h"

namespace feeler {
namespace {
constexpr std::array<std::string_view, kDirectionCount> kNames = {"+x", "-x", "+y", "-y", "+z", "-z"};
}  // namespace

std::string_view ToString(Direction d) { return kNames[static_cast<std::size_t>(IndexOf(d))]; }

std::optional<Direction> ParseDirection(std::string_view text) {
  for (const Direction d : kDirections) {
    if (ToString(d) == text) return d;
  }
  return std::nullopt;
}

}  // namespace feeler
