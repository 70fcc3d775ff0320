#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace feeler::perception {

/// Expands a block of LibLZF (Lehmann), as PCD files of DATA binary_compressed hold it, to exactly `size` bytes;
/// nothing if the block is damaged or of another size.
inline std::optional<std::string> LzfDecompress(std::string_view block, std::size_t size) {
  std::string plain;
  plain.reserve(size);
  std::size_t at = 0;
  const auto byte = [&] { return static_cast<std::size_t>(static_cast<unsigned char>(block[at++])); };
  while (at < block.size()) {
    const std::size_t control = byte();
    if (control < 32) {  // literal bytes, one more than the control says
      const std::size_t count = control + 1;
      if (count > block.size() - at || count > size - plain.size()) return std::nullopt;
      plain.append(block.substr(at, count));
      at += count;
      continue;
    }
    std::size_t count = (control >> 5) + 2;  // a copy of earlier bytes, which may overlap with what it writes
    if (count == 9) {
      if (at >= block.size()) return std::nullopt;
      count += byte();
    }
    if (at >= block.size()) return std::nullopt;
    const std::size_t back = ((control & 31) << 8 | byte()) + 1;
    if (back > plain.size() || count > size - plain.size()) return std::nullopt;
    for (std::size_t i = 0; i < count; ++i) plain.push_back(plain[plain.size() - back]);
  }
  if (plain.size() != size) return std::nullopt;
  return plain;
}

}  // namespace feeler::perception
