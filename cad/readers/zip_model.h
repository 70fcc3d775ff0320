#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace feeler::cad {

/// The model in a 3MF package (a zip), as far as can be told without unpacking it.
struct ZipModel {
  std::uint64_t bytes = 0;  ///< unpacked
  std::string head;         ///< its first kilobytes
};
/// Nothing where the file is no zip, or holds no .model.
std::optional<ZipModel> PeekZipModel(const std::filesystem::path& file);

/// The unit that a 3MF model says it is in ("micron", "inch" ...), in metres; nothing where it says none.
struct NamedLength {
  std::string name;
  double metres = 0.0;
};
std::optional<NamedLength> UnitOfModel(const std::string& head);

}  // namespace feeler::cad
