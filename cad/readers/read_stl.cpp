#include "feeler/cad/readers/read_stl.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "feeler/cad/readers/lines.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

constexpr std::int64_t kHeader = 84;
constexpr std::int64_t kFacet = 50;

/// How a file is taken, and why.
struct StlKind {
  bool binary = false;
  std::int64_t counted = 0;  ///< in the header
  std::int64_t there = 0;    ///< as many as the file is long enough for
  std::int64_t beyond = 0;   ///< bytes after the last
};

bool IsText(std::string_view bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](char c) {
    const auto u = static_cast<unsigned char>(c);
    return u >= 32 || c == '\n' || c == '\r' || c == '\t' || c == '\f';
  });
}

/// A binary file is as long as its count says; many begin with "solid" all the same. What has another length is told
/// by whether it is text.
StlKind KindOf(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = static_cast<std::int64_t>(std::filesystem::file_size(file, error));
  if (error || size == 0) throw InputError(file.string(), "is empty", "export it again");
  std::string head(static_cast<std::size_t>(std::min<std::int64_t>(size, 1024)), '\0');
  std::ifstream(file, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
  StlKind kind;
  if (size >= kHeader) {
    for (std::size_t k = 4; k-- > 0;) kind.counted = 256 * kind.counted + static_cast<unsigned char>(head[80 + k]);
    kind.there = std::min(kind.counted, (size - kHeader) / kFacet);
    kind.beyond = size - kHeader - kFacet * kind.counted;
    kind.binary = kind.beyond == 0;
  }
  if (kind.binary || IsText(head)) return kind;
  kind.binary = true;
  if (size < kHeader) {
    throw InputError(file.string(), fmt::format("is a binary STL of {} bytes, less than its header has", size),
                     "it was cut short: export or copy it again");
  }
  if (kind.beyond < 0) {
    throw InputError(
        file.string(),
        fmt::format("is a binary STL that was cut short: {} of its {} triangles are there", kind.there, kind.counted),
        "export or copy it again");
  }
  return kind;
}

float FloatAt(const char* bytes) {
  float value = 0;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

RawPart ReadBinary(const std::filesystem::path& file, const StlKind& kind) {
  std::ifstream in(file, std::ios::binary);
  in.seekg(kHeader);
  RawBody body{file.stem().string(), {}, {}};
  std::array<char, kFacet> facet{};
  for (std::int64_t t = 0; t < kind.counted && in.read(facet.data(), facet.size()); ++t) {
    std::array<int, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const char* at = facet.data() + 12 + 12 * k;
      corners[k] = static_cast<int>(body.mesh.points.size());
      body.mesh.points.emplace_back(FloatAt(at), FloatAt(at + 4), FloatAt(at + 8));
    }
    body.mesh.triangles.push_back(corners);
  }
  RawPart part{"STL, binary", {std::move(body)}, std::nullopt};
  if (kind.beyond > 0) {
    part.notes.push_back(
        fmt::format("{} bytes after the {} triangles that the header counts are left out", kind.beyond, kind.counted));
  }
  return part;
}

class AsciiStl {
 public:
  explicit AsciiStl(const std::filesystem::path& file) : file_(file), lines_(file) {}

  RawPart Run() {
    bool ended = false;
    for (std::string line; lines_.Next(line);) {
      std::string_view rest(line);
      const std::string word = Lower(NextWord(rest));
      if (word == "solid") {
        Begin(std::string(rest));
        ended = false;
      } else if (word == "vertex") {
        Vertex(rest);
      } else if (word == "endloop") {
        EndLoop();
      } else if (word == "endsolid") {
        ended = true;
      }
    }
    if (corners_ > 0) Fail("the file ends within a facet: it was cut short");
    std::erase_if(part_.bodies, [](const RawBody& body) { return body.mesh.triangles.empty(); });
    if (part_.bodies.empty()) {
      throw InputError(file_.string(), "is text without one facet: no STL, or an empty one", "export it again");
    }
    if (!ended) part_.notes.emplace_back("the last solid has no end: was the file cut short?");
    return std::move(part_);
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}", file_.string(), lines_.number()), what, "export it again");
  }

  void Begin(const std::string& name) {
    const std::size_t from = name.find_first_not_of(" \t");
    const std::size_t to = name.find_last_not_of(" \t");
    std::string plain = from == std::string::npos ? "" : name.substr(from, to - from + 1);
    if (plain.empty()) plain = fmt::format("solid {}", part_.bodies.size() + 1);
    part_.bodies.push_back({std::move(plain), {}, {}});
  }

  TriangleMesh& Mesh() {
    if (part_.bodies.empty()) Begin("");
    return part_.bodies.back().mesh;
  }

  void Vertex(std::string_view rest) {
    Eigen::Vector3d p;
    for (int k = 0; k < 3; ++k) {
      if (!NextNumber(rest, p[k])) Fail("a vertex has not three numbers");
    }
    Mesh().points.push_back(p);
    ++corners_;
  }

  void EndLoop() {
    if (corners_ != 3) Fail(fmt::format("a facet of {} corners", corners_));
    const int last = static_cast<int>(Mesh().points.size());
    Mesh().triangles.push_back({last - 3, last - 2, last - 1});
    corners_ = 0;
  }

  const std::filesystem::path& file_;
  Lines lines_;
  RawPart part_{"STL, ascii", {}, std::nullopt};
  int corners_ = 0;
};

}  // namespace

RawPart ReadStl(const std::filesystem::path& file) {
  const StlKind kind = KindOf(file);
  return kind.binary ? ReadBinary(file, kind) : AsciiStl(file).Run();
}

std::int64_t CountStl(const std::filesystem::path& file, std::int64_t most) {
  const StlKind kind = KindOf(file);
  if (kind.binary) return kind.counted;
  Lines lines(file);
  std::int64_t count = 0;
  for (std::string line; count <= most && lines.Next(line);) {
    std::string_view rest(line);
    if (Lower(NextWord(rest)) == "facet") ++count;
  }
  return count;
}

}  // namespace feeler::cad
