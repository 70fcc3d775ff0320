#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace feeler::execution {

/// Base64 (RFC 4648), with padding.
std::string ToBase64(std::span<const std::uint8_t> bytes);
/// Empty for what is none.
std::optional<std::vector<std::uint8_t>> FromBase64(std::string_view text);

}  // namespace feeler::execution
