#include "feeler/perception/cloud_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "feeler/perception/byte_cursor.h"
#include "feeler/perception/cloud_kind.h"
#include "feeler/perception/input_file.h"
#include "feeler/perception/lzf.h"

namespace feeler::perception {
namespace {

constexpr std::size_t kMostPoints = std::size_t{1} << 25;
constexpr std::size_t kMostHeaderLines = 1000;
constexpr std::size_t kMostFields = 256;

std::size_t Count(std::string_view word, const ByteCursor& cursor) {
  std::size_t count = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), count);
  if (error != std::errc() || end != word.data() + word.size() || count > kMostPoints) {
    cursor.Fail(fmt::format("has '{}' where a count of at most {} should stand", word.substr(0, 20), kMostPoints));
  }
  return count;
}

/// The words of the next line that is not blank.
std::vector<std::string_view> NextWords(ByteCursor& cursor) {
  for (;;) {
    std::vector<std::string_view> words = Words(cursor.Line());
    if (!words.empty()) return words;
  }
}

/// Puts x, y and z together and keeps what is finite.
class Collector {
 public:
  void Set(int axis, double value) { point_[axis] = value; }
  void Finish() {
    if (point_.allFinite()) points_.push_back(point_);
  }
  Points Take() { return std::move(points_); }

 private:
  Eigen::Vector3d point_ = Eigen::Vector3d::Zero();
  Points points_;
};

// --- PLY (Turk 1994) ---

struct PlyProperty {
  NumberType type = NumberType::kFloat;
  std::optional<NumberType> count_type;  ///< of a list
  int axis = -1;                         ///< 0..2: x, y, z
};

struct PlyElement {
  bool vertex = false;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

std::optional<NumberType> PlyType(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, NumberType>, 16> kTypes = {{
      {"char", NumberType::kInt8},
      {"int8", NumberType::kInt8},
      {"uchar", NumberType::kUint8},
      {"uint8", NumberType::kUint8},
      {"short", NumberType::kInt16},
      {"int16", NumberType::kInt16},
      {"ushort", NumberType::kUint16},
      {"uint16", NumberType::kUint16},
      {"int", NumberType::kInt32},
      {"int32", NumberType::kInt32},
      {"uint", NumberType::kUint32},
      {"uint32", NumberType::kUint32},
      {"float", NumberType::kFloat},
      {"float32", NumberType::kFloat},
      {"double", NumberType::kDouble},
      {"float64", NumberType::kDouble},
  }};
  for (const auto& [known, type] : kTypes) {
    if (name == known) return type;
  }
  return std::nullopt;
}

int AxisOfName(std::string_view name) {
  if (name == "x" || name == "X") return 0;
  if (name == "y" || name == "Y") return 1;
  return name == "z" || name == "Z" ? 2 : -1;
}

PlyProperty ParseProperty(const std::vector<std::string_view>& words, const ByteCursor& cursor) {
  const bool list = words.size() > 1 && words[1] == "list";
  if (words.size() != (list ? 5U : 3U)) cursor.Fail("has a 'property' line with a wrong number of words");
  const auto type = PlyType(words[list ? 3 : 1]);
  if (!type) cursor.Fail(fmt::format("has a property of type '{}'", words[list ? 3 : 1].substr(0, 20)));
  PlyProperty property{*type, std::nullopt, list ? -1 : AxisOfName(words.back())};
  if (list) {
    property.count_type = PlyType(words[2]);
    if (!property.count_type) cursor.Fail("has a list whose count is of no known type");
  }
  return property;
}

enum class Encoding { kText, kLittleEndian, kBigEndian };

std::vector<PlyElement> ParsePlyHeader(ByteCursor& cursor, Encoding& encoding) {
  std::vector<PlyElement> elements;
  bool format = false;
  for (std::size_t line_number = 0; line_number < kMostHeaderLines; ++line_number) {
    const std::vector<std::string_view> words = Words(cursor.Line());
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info" || words[0] == "ply") continue;
    if (words[0] == "end_header") {
      if (!format) cursor.Fail("has no 'format' line");
      return elements;
    }
    if (words[0] == "format") {
      if (words.size() < 2) cursor.Fail("has an empty 'format' line");
      if (words[1] == "ascii") {
        encoding = Encoding::kText;
      } else if (words[1] == "binary_little_endian") {
        encoding = Encoding::kLittleEndian;
      } else if (words[1] == "binary_big_endian") {
        encoding = Encoding::kBigEndian;
      } else {
        cursor.Fail(fmt::format("is of the unknown format '{}'", words[1].substr(0, 30)));
      }
      format = true;
    } else if (words[0] == "element") {
      if (words.size() != 3 || elements.size() >= kMostFields) cursor.Fail("has a malformed 'element' line");
      elements.push_back({words[1] == "vertex", Count(words[2], cursor), {}});
    } else if (words[0] == "property") {
      if (elements.empty()) cursor.Fail("has a property before its element");
      if (elements.back().properties.size() >= kMostFields) cursor.Fail("has too many properties");
      elements.back().properties.push_back(ParseProperty(words, cursor));
    } else {
      cursor.Fail(fmt::format("has the unknown header line '{}'", words[0].substr(0, 20)));
    }
  }
  cursor.Fail("has a header without end");
}

Points ParsePly(ByteCursor& cursor) {
  Encoding encoding = Encoding::kText;
  const std::vector<PlyElement> elements = ParsePlyHeader(cursor, encoding);
  std::optional<LineNumbers> line;  // of a text
  const auto number = [&](NumberType type) {
    return line ? line->Next() : cursor.BinaryNumber(type, encoding == Encoding::kBigEndian);
  };
  const auto skip_list = [&](const PlyProperty& property) {
    const double count = number(*property.count_type);
    if (!(count >= 0.0 && count <= 1e6)) cursor.Fail("has a list of an impossible length");
    for (auto i = static_cast<std::size_t>(count); i > 0; --i) number(property.type);
  };
  for (const PlyElement& element : elements) {
    if (element.properties.empty()) continue;
    std::array<bool, 3> given{};
    for (const PlyProperty& property : element.properties) {
      if (property.axis >= 0) given[static_cast<std::size_t>(property.axis)] = true;
    }
    if (element.vertex && !(given[0] && given[1] && given[2])) cursor.Fail("has vertices without x, y and z");
    Collector collector;
    for (std::size_t i = 0; i < element.count; ++i) {
      if (encoding == Encoding::kText) line.emplace(cursor, NextWords(cursor));
      for (const PlyProperty& property : element.properties) {
        if (property.count_type) {
          skip_list(property);
        } else {
          const double value = number(property.type);
          if (property.axis >= 0) collector.Set(property.axis, value);
        }
      }
      if (line) line->End();
      if (element.vertex) collector.Finish();
    }
    if (element.vertex) return collector.Take();
  }
  cursor.Fail("has no vertices");
}

// --- PCD (Point Cloud Library, file format v0.7) ---

struct PcdField {
  NumberType type = NumberType::kFloat;
  std::size_t count = 1;
  int axis = -1;
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::vector<std::string> sizes, types, counts;
  std::size_t points = 0;
  std::optional<std::size_t> width, height;
  std::string data;
  bool moved_viewpoint = false;
};

/// Whether a VIEWPOINT line (translation, quaternion w x y z) says other than the identity.
bool IsMoved(const std::vector<std::string_view>& words, const ByteCursor& cursor) {
  constexpr std::array<double, 7> kIdentity = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
  if (words.size() != kIdentity.size() + 1) cursor.Fail("has a VIEWPOINT of other than 7 numbers");
  bool moved = false;
  for (std::size_t i = 0; i < kIdentity.size(); ++i) {
    if (cursor.TextNumber(words[i + 1]) != kIdentity[i]) moved = true;
  }
  return moved;
}

NumberType PcdType(std::string_view type, std::string_view size, const ByteCursor& cursor) {
  constexpr std::array<std::pair<std::string_view, NumberType>, 10> kTypes = {{
      {"I1", NumberType::kInt8},
      {"I2", NumberType::kInt16},
      {"I4", NumberType::kInt32},
      {"I8", NumberType::kInt64},
      {"U1", NumberType::kUint8},
      {"U2", NumberType::kUint16},
      {"U4", NumberType::kUint32},
      {"U8", NumberType::kUint64},
      {"F4", NumberType::kFloat},
      {"F8", NumberType::kDouble},
  }};
  const std::string name = std::string(type) + std::string(size);
  for (const auto& [known, number_type] : kTypes) {
    if (name == known) return number_type;
  }
  cursor.Fail(fmt::format("has a field of type {} and size {}", type.substr(0, 10), size.substr(0, 10)));
}

PcdHeader ParsePcdHeader(ByteCursor& cursor) {
  PcdHeader header;
  bool points = false;
  const auto texts = [](const std::vector<std::string_view>& words) {
    return std::vector<std::string>(words.begin() + 1, words.end());
  };
  for (std::size_t line_number = 0; header.data.empty(); ++line_number) {
    if (line_number >= kMostHeaderLines) cursor.Fail("has a header without end");
    const std::vector<std::string_view> words = Words(cursor.Line());
    if (words.empty() || words[0].front() == '#') continue;
    if (words.size() < 2) cursor.Fail(fmt::format("has an empty '{}' line", words[0].substr(0, 20)));
    if (words.size() > kMostFields) cursor.Fail("has too many fields");
    const std::string key = Upper(words[0]);
    if (key == "FIELDS" || key == "COLUMNS") {
      header.fields.clear();
      for (std::size_t i = 1; i < words.size(); ++i)
        header.fields.push_back({NumberType::kFloat, 1, AxisOfName(words[i])});
    } else if (key == "SIZE") {
      header.sizes = texts(words);
    } else if (key == "TYPE") {
      header.types = texts(words);
    } else if (key == "COUNT") {
      header.counts = texts(words);
    } else if (key == "WIDTH") {
      header.width = Count(words[1], cursor);
    } else if (key == "HEIGHT") {
      header.height = Count(words[1], cursor);
    } else if (key == "POINTS") {
      header.points = Count(words[1], cursor);
      points = true;
    } else if (key == "DATA") {
      header.data = words[1];
    } else if (key == "VIEWPOINT") {
      header.moved_viewpoint = IsMoved(words, cursor);
    } else if (key != "VERSION") {
      cursor.Fail(fmt::format("has the unknown header line '{}'", words[0].substr(0, 20)));
    }
  }
  const std::size_t fields = header.fields.size();
  if (header.sizes.size() != fields || header.types.size() != fields ||
      (!header.counts.empty() && header.counts.size() != fields)) {
    cursor.Fail("has FIELDS, SIZE, TYPE and COUNT of different lengths");
  }
  std::array<bool, 3> given{};
  for (std::size_t i = 0; i < fields; ++i) {
    PcdField& field = header.fields[i];
    field.type = PcdType(header.types[i], header.sizes[i], cursor);
    if (!header.counts.empty()) field.count = Count(header.counts[i], cursor);
    if (field.axis >= 0 && field.count == 1) given[static_cast<std::size_t>(field.axis)] = true;
    if (field.count != 1) field.axis = -1;
  }
  if (!(given[0] && given[1] && given[2])) cursor.Fail("has points without x, y and z");
  if (!points) header.points = header.width.value_or(0) * header.height.value_or(1);
  if (header.points > kMostPoints) cursor.Fail(fmt::format("has more than {} points", kMostPoints));
  if (points && header.width && header.height && *header.width * *header.height != header.points) {
    cursor.Fail("has a number of POINTS that is not WIDTH times HEIGHT");
  }
  return header;
}

std::size_t Stride(const PcdHeader& header, const ByteCursor& cursor) {
  std::size_t stride = 0;
  for (const PcdField& field : header.fields) stride += field.count * SizeOf(field.type);
  if (stride > kLargestFile || header.points * stride > kLargestFile) cursor.Fail("is too large");
  return stride;
}

Points PcdText(const PcdHeader& header, ByteCursor& cursor) {
  Collector collector;
  for (std::size_t i = 0; i < header.points; ++i) {
    LineNumbers line(cursor, NextWords(cursor));
    for (const PcdField& field : header.fields) {
      for (std::size_t k = 0; k < field.count; ++k) {
        const double value = line.Next();
        if (field.axis >= 0) collector.Set(field.axis, value);
      }
    }
    line.End();
    collector.Finish();
  }
  return collector.Take();
}

Points PcdBinary(const PcdHeader& header, ByteCursor& cursor) {
  if (header.points * Stride(header, cursor) > cursor.left()) cursor.Fail("is cut off");
  Collector collector;
  for (std::size_t i = 0; i < header.points; ++i) {
    for (const PcdField& field : header.fields) {
      if (field.axis < 0) {
        cursor.Skip(field.count * SizeOf(field.type));
      } else {
        collector.Set(field.axis, cursor.BinaryNumber(field.type, false));
      }
    }
    collector.Finish();
  }
  return collector.Take();
}

/// Two sizes, then the points by LZF, field after field instead of point after point.
Points PcdCompressed(const PcdHeader& header, ByteCursor& cursor, const std::string& where) {
  const std::size_t size = header.points * Stride(header, cursor);
  const auto compressed = static_cast<std::size_t>(cursor.BinaryNumber(NumberType::kUint32, false));
  const auto plain = static_cast<std::size_t>(cursor.BinaryNumber(NumberType::kUint32, false));
  if (compressed > cursor.left()) cursor.Fail("is cut off");
  if (plain != size) cursor.Fail(fmt::format("has {} bytes of points where {} should be", plain, size));
  const std::optional<std::string> bytes = LzfDecompress(cursor.Rest().substr(0, compressed), plain);
  if (!bytes) cursor.Fail("has compressed points that are damaged");
  Points points(header.points, Eigen::Vector3d::Zero());
  ByteCursor fields(*bytes, where);
  for (const PcdField& field : header.fields) {
    if (field.axis < 0) {
      fields.Skip(header.points * field.count * SizeOf(field.type));
      continue;
    }
    for (Eigen::Vector3d& point : points) point[field.axis] = fields.BinaryNumber(field.type, false);
  }
  std::erase_if(points, [](const Eigen::Vector3d& point) { return !point.allFinite(); });
  return points;
}

Points ParsePcd(ByteCursor& cursor, const std::string& where, std::vector<std::string>* notes) {
  const PcdHeader header = ParsePcdHeader(cursor);
  if (header.moved_viewpoint && notes != nullptr) {
    notes->push_back(where + ": its VIEWPOINT is ignored: coordinates are taken as those of the world");
  }
  const std::string kind = Upper(header.data);
  if (kind == "ASCII") return PcdText(header, cursor);
  if (kind == "BINARY") return PcdBinary(header, cursor);
  if (kind == "BINARY_COMPRESSED") return PcdCompressed(header, cursor, where);
  cursor.Fail(fmt::format("has DATA of the unknown kind '{}'", header.data.substr(0, 30)));
}

/// Coordinates of a depth camera's scene in metres are small.
void RequireMetres(const Points& points, const ByteCursor& cursor) {
  constexpr double kFarthest_m = 50.0;
  std::vector<double> sizes;
  sizes.reserve(points.size());
  for (const Eigen::Vector3d& p : points) sizes.push_back(p.cwiseAbs().maxCoeff());
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  if (*middle > kFarthest_m) {
    cursor.Fail(fmt::format("has coordinates of typically {:.3g}, as in millimetres: scale them to metres", *middle));
  }
}

}  // namespace

Points ParseCloud(std::string_view bytes, const std::string& where, std::vector<std::string>* notes) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (bytes.substr(0, kByteOrderMark.size()) == kByteOrderMark) bytes.remove_prefix(kByteOrderMark.size());
  ByteCursor cursor(bytes, where);
  if (bytes.empty()) cursor.Fail("is empty");
  Points points = KindOf(bytes, where) == CloudKind::kPly ? ParsePly(cursor) : ParsePcd(cursor, where, notes);
  if (points.empty()) cursor.Fail("holds no point with finite coordinates");
  RequireMetres(points, cursor);
  return points;
}

Points ReadCloud(const std::string& path, std::vector<std::string>* notes) {
  return ParseCloud(ReadFile(path), path, notes);
}

}  // namespace feeler::perception
