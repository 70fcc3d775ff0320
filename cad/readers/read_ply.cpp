#include "feeler/cad/readers/read_ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "feeler/cad/readers/ears.h"
#include "feeler/cad/readers/lines.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

enum class Number { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::optional<Number> NumberOf(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, Number>, 16> kNames{{{"char", Number::kInt8},
                                                                        {"int8", Number::kInt8},
                                                                        {"uchar", Number::kUint8},
                                                                        {"uint8", Number::kUint8},
                                                                        {"short", Number::kInt16},
                                                                        {"int16", Number::kInt16},
                                                                        {"ushort", Number::kUint16},
                                                                        {"uint16", Number::kUint16},
                                                                        {"int", Number::kInt32},
                                                                        {"int32", Number::kInt32},
                                                                        {"uint", Number::kUint32},
                                                                        {"uint32", Number::kUint32},
                                                                        {"float", Number::kFloat},
                                                                        {"float32", Number::kFloat},
                                                                        {"double", Number::kDouble},
                                                                        {"float64", Number::kDouble}}};
  const auto found = std::ranges::find(kNames, name, &std::pair<std::string_view, Number>::first);
  return found == kNames.end() ? std::nullopt : std::optional(found->second);
}

std::size_t BytesOf(Number number) {
  constexpr std::array<std::size_t, 8> kBytes{1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(number)];
}

template <typename T>
double As(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

double Value(Number number, const char* bytes) {
  switch (number) {
    case Number::kInt8: return As<std::int8_t>(bytes);
    case Number::kUint8: return As<std::uint8_t>(bytes);
    case Number::kInt16: return As<std::int16_t>(bytes);
    case Number::kUint16: return As<std::uint16_t>(bytes);
    case Number::kInt32: return As<std::int32_t>(bytes);
    case Number::kUint32: return As<std::uint32_t>(bytes);
    case Number::kFloat: return As<float>(bytes);
    case Number::kDouble: return As<double>(bytes);
  }
  return 0.0;
}

struct Property {
  std::string name;
  Number number = Number::kFloat;
  std::optional<Number> count;  ///< of a list
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;

  std::optional<std::size_t> Find(std::string_view wanted) const {
    const auto found = std::ranges::find(properties, wanted, &Property::name);
    if (found == properties.end()) return std::nullopt;
    return static_cast<std::size_t>(found - properties.begin());
  }
};

class PlyReader {
 public:
  explicit PlyReader(const std::filesystem::path& file) : file_(file), lines_(file) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    bytes_ = error ? 0.0 : static_cast<double>(bytes);
  }

  RawPart Run() {
    Header();
    part_.format = binary_ ? "PLY, binary" : "PLY, ascii";
    part_.bodies.push_back({file_.stem().string(), {}, {}});
    for (const Element& element : elements_) {
      if (element.name == "vertex") {
        Vertices(element);
      } else if (element.name == "face") {
        Faces(element);
      } else {
        for (std::int64_t row = 0; row < element.count; ++row) Row(element, row);
        if (element.count > 0) {
          part_.notes.push_back(fmt::format("{} elements \"{}\" are left out", element.count, element.name));
        }
      }
    }
    return std::move(part_);
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(fmt::format("{}: line {}", file_.string(), lines_.number()), what, "export it again");
  }
  [[noreturn]] void FailAt(const Element& element, std::int64_t row, const std::string& what) const {
    if (!binary_) Fail(what);
    throw InputError(fmt::format("{}: {} {} of {}", file_.string(), element.name, row + 1, element.count), what,
                     "export it again");
  }

  void Header() {
    constexpr int kMostLines = 10'000;
    std::string line;
    if (!lines_.Next(line) || line != "ply") {
      throw InputError(file_.string(), "does not begin with \"ply\"", "give a PLY file, or name it as what it is");
    }
    bool format = false;
    while (lines_.Next(line) && lines_.number() < kMostLines) {
      std::string_view rest(line);
      const std::string_view word = NextWord(rest);
      if (word == "end_header") {
        if (!format) Fail("the header names no format");
        return;
      }
      if (word == "format") {
        Format(NextWord(rest));
        format = true;
      } else if (word == "element") {
        BeginElement(rest);
      } else if (word == "property") {
        AddProperty(rest);
      } else if (!word.empty() && word != "comment" && word != "obj_info") {
        Fail("a line of the header that is none of format, element, property, comment");
      }
    }
    Fail("the header has no end (end_header)");
  }

  void Format(std::string_view name) {
    binary_ = name != "ascii";
    if (binary_ && name != "binary_little_endian" && name != "binary_big_endian") {
      Fail("the format is none of ascii, binary_little_endian, binary_big_endian");
    }
    swapped_ = binary_ && (name == "binary_big_endian") != (std::endian::native == std::endian::big);
  }

  void BeginElement(std::string_view rest) {
    Element element;
    element.name = NextWord(rest);
    double count = 0;
    // No reader is to make room for what is not there: a row takes a byte, or a line end.
    if (!NextNumber(rest, count) || !(count >= 0) || count > bytes_) {
      Fail(fmt::format("the header speaks of more elements \"{}\" than the file has bytes", element.name));
    }
    element.count = static_cast<std::int64_t>(count);
    if (element.name == "face") RequireFew(element.count);
    elements_.push_back(std::move(element));
  }

  void AddProperty(std::string_view rest) {
    if (elements_.empty()) Fail("a property before the first element");
    Property property;
    std::string_view word = NextWord(rest);
    if (word == "list") {
      property.count = NumberOf(NextWord(rest));
      if (!property.count || *property.count >= Number::kFloat) Fail("a list whose count is no whole number");
      word = NextWord(rest);
    }
    const std::optional<Number> number = NumberOf(word);
    if (!number) Fail("a property of no known type");
    property.number = *number;
    property.name = NextWord(rest);
    elements_.back().properties.push_back(std::move(property));
  }

  /// Reads a row of an element: one number a property, of a list as many as it says.
  void Row(const Element& element, std::int64_t row) {
    values_.resize(element.properties.size());
    if (!binary_) {
      do {
        if (!lines_.Next(line_)) Fail(fmt::format("the file ends after {} of {} {}", row, element.count, element.name));
        rest_ = line_;
      } while (line_.find_first_not_of(" \t") == std::string::npos);
    }
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const Property& property = element.properties[p];
      std::size_t count = 1;
      if (property.count) {
        const double told = NextValue(*property.count, element, row);
        if (!(told >= 0) || told > bytes_ || told != std::floor(told))
          FailAt(element, row, "a list of no sound length");
        count = static_cast<std::size_t>(told);
      }
      values_[p].resize(count);
      for (double& value : values_[p]) value = NextValue(property.number, element, row);
    }
    if (!binary_ && !NextWord(rest_).empty()) Fail(fmt::format("more numbers than a {} has", element.name));
  }

  double NextValue(Number number, const Element& element, std::int64_t row) {
    double value = 0;
    if (!binary_) {
      if (!NextNumber(rest_, value)) Fail(fmt::format("fewer numbers than a {} has", element.name));
      return value;
    }
    std::array<char, 8> bytes{};
    const std::span<char> read(bytes.data(), BytesOf(number));
    if (!lines_.Read(read)) FailAt(element, row, "the file ends here: it was cut short");
    if (swapped_) std::ranges::reverse(read);
    return Value(number, bytes.data());
  }

  void Vertices(const Element& element) {
    std::array<std::size_t, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto found = element.Find(std::string_view("xyz").substr(k, 1));
      if (!found || element.properties[*found].count) {
        throw InputError(file_.string(), "its vertices have no x, y and z", "export it again");
      }
      at[k] = *found;
    }
    TriangleMesh& mesh = part_.bodies.back().mesh;
    for (std::int64_t row = 0; row < element.count; ++row) {
      Row(element, row);
      const Eigen::Vector3d point(values_[at[0]][0], values_[at[1]][0], values_[at[2]][0]);
      if (!point.allFinite()) FailAt(element, row, "a vertex that is not finite");
      mesh.points.push_back(point);
    }
  }

  void Faces(const Element& element) {
    auto corners = element.Find("vertex_indices");
    if (!corners) corners = element.Find("vertex_index");
    if (!corners || !element.properties[*corners].count) {
      throw InputError(file_.string(), "its faces have no list vertex_indices", "export it again");
    }
    TriangleMesh& mesh = part_.bodies.back().mesh;
    std::vector<int> face;
    for (std::int64_t row = 0; row < element.count; ++row) {
      Row(element, row);
      const std::vector<double>& list = values_[*corners];
      if (list.size() < 3) FailAt(element, row, "a face of fewer than three corners");
      if (list.size() > kMostCorners) {
        FailAt(element, row, fmt::format("a face of {} corners, more than {}", list.size(), kMostCorners));
      }
      face.clear();
      for (const double index : list) {
        if (!(index >= 0 && index < static_cast<double>(mesh.points.size())) || index != std::floor(index)) {
          FailAt(element, row, fmt::format("a face names vertex {}, of {}", index, mesh.points.size()));
        }
        face.push_back(static_cast<int>(index));
      }
      for (const auto& triangle : CutEars(mesh.points, face)) mesh.triangles.push_back(triangle);
      RequireFew(mesh.size());
    }
  }

  void RequireFew(std::int64_t triangles) const {
    if (triangles > kMostTriangles) TooMany(file_, triangles);
  }

  const std::filesystem::path& file_;
  Lines lines_;
  double bytes_ = 0.0;
  bool binary_ = false;
  bool swapped_ = false;
  std::vector<Element> elements_;
  std::vector<std::vector<double>> values_;  ///< of a row, by property
  std::string line_;
  std::string_view rest_;
  RawPart part_;
};

}  // namespace

RawPart ReadPly(const std::filesystem::path& file) { return PlyReader(file).Run(); }

}  // namespace feeler::cad
