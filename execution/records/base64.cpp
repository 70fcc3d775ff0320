#include "feeler/execution/records/base64.h"

namespace feeler::execution {
namespace {

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

std::string ToBase64(std::span<const std::uint8_t> bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t rest = bytes.size() - i;
    const std::uint32_t group = static_cast<std::uint32_t>(bytes[i]) << 16 |
                                (rest > 1 ? static_cast<std::uint32_t>(bytes[i + 1]) << 8 : 0U) |
                                (rest > 2 ? static_cast<std::uint32_t>(bytes[i + 2]) : 0U);
    text += kDigits[group >> 18];
    text += kDigits[group >> 12 & 63U];
    text += rest > 1 ? kDigits[group >> 6 & 63U] : '=';
    text += rest > 2 ? kDigits[group & 63U] : '=';
  }
  return text;
}

std::optional<std::vector<std::uint8_t>> FromBase64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 4 * 3);
  for (std::size_t i = 0; i < text.size(); i += 4) {
    std::uint32_t group = 0;
    int digits = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t digit = kDigits.find(text[i + k]);
      if (digit == std::string_view::npos) {
        if (text[i + k] != '=' || k < 2 || i + 4 != text.size()) return std::nullopt;
        group <<= 6;
        continue;
      }
      if (digits != static_cast<int>(k)) return std::nullopt;  // a digit behind the padding
      group = group << 6 | static_cast<std::uint32_t>(digit);
      ++digits;
    }
    for (int k = 0; k < digits - 1; ++k) bytes.push_back(static_cast<std::uint8_t>(group >> (16 - 8 * k)));
  }
  return bytes;
}

}  // namespace feeler::execution
