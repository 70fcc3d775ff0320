#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/perception/byte_cursor.h"

namespace feeler::perception {

enum class CloudKind { kPly, kPcd };

/// What kind of cloud the first line that is neither blank nor a comment says. Throws InputError for what is no cloud,
/// with the name of an OBJ or STL mesh.
inline CloudKind KindOf(std::string_view bytes, const std::string& where) {
  ByteCursor cursor(bytes, where);
  std::string first;
  while (first.empty() && cursor.left() > 0) {
    const std::vector<std::string_view> words = Words(cursor.Line());
    if (!words.empty() && words[0].front() != '#') first = words[0].substr(0, 16);
  }
  const std::string key = Upper(first);
  if (first == "ply") return CloudKind::kPly;
  for (const char* known :
       {"VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"}) {
    if (key == known) return CloudKind::kPcd;
  }
  const auto mesh = [&](const char* kind) {
    cursor.Fail(fmt::format("is {} mesh, neither a PLY nor a PCD file of measured points", kind));
  };
  for (const char* known : {"v", "vn", "vt", "f", "o", "g", "mtllib", "usemtl"}) {
    if (first == known) mesh("an OBJ");
  }
  if (first == "solid") mesh("an STL");
  constexpr std::size_t kStlHeader = 80;
  constexpr std::size_t kStlTriangle = 50;
  if (bytes.size() >= kStlHeader + 4) {
    ByteCursor stl(bytes, where);
    stl.Skip(kStlHeader);
    const auto triangles = static_cast<std::size_t>(stl.BinaryNumber(NumberType::kUint32, false));
    if (triangles > 0 && stl.left() == triangles * kStlTriangle) mesh("an STL");
  }
  cursor.Fail("is neither a PLY nor a PCD file");
}

}  // namespace feeler::perception
