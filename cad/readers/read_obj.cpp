#include "feeler/cad/readers/read_obj.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "feeler/cad/readers/ears.h"
#include "feeler/cad/readers/lines.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

/// The next line, with those that it goes on in after a backslash.
bool NextWhole(Lines& lines, std::string& line) {
  if (!lines.Next(line)) return false;
  std::string more;
  while (!line.empty() && line.back() == '\\') {
    line.back() = ' ';
    if (!lines.Next(more)) break;
    line += more;
  }
  return true;
}

class ObjReader {
 public:
  explicit ObjReader(const std::filesystem::path& file) : file_(file), lines_(file) {}

  RawPart Run() {
    for (std::string line; NextWhole(lines_, line);) {
      std::string_view rest(line);
      const std::string_view word = NextWord(rest);
      if (word == "v") {
        Eigen::Vector3d p;
        for (int k = 0; k < 3; ++k) {
          if (!NextNumber(rest, p[k])) Fail("a vertex has not three numbers");
        }
        points_.push_back(p);
      } else if (word == "f") {
        Face(rest);
      } else if (word == "o") {
        object_ = NextWord(rest);
        group_.clear();
      } else if (word == "g") {
        group_ = NextWord(rest);
      }
    }
    return std::move(part_);
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}", file_.string(), lines_.number()), what, "export it again");
  }

  void Face(std::string_view rest) {
    std::vector<int> face;
    for (std::string_view word = NextWord(rest); !word.empty(); word = NextWord(rest)) {
      double value = 0;
      if (!NextNumber(word, value)) break;
      const double index = value < 0 ? static_cast<double>(points_.size()) + value : value - 1;
      if (!(index >= 0 && index < static_cast<double>(points_.size())))
        Fail(fmt::format("a face names vertex {}", value));
      face.push_back(static_cast<int>(index));
    }
    if (face.size() < 3) Fail("a face of fewer than three corners");
    if (face.size() > kMostCorners) Fail(fmt::format("a face of {} corners, more than {}", face.size(), kMostCorners));
    const std::size_t body = Body();
    for (const auto& triangle : CutEars(points_, face)) {
      std::array<int, 3> corners{};
      for (std::size_t k = 0; k < 3; ++k) corners[k] = NumberIn(body, triangle[k]);
      part_.bodies[body].mesh.triangles.push_back(corners);
    }
  }

  std::size_t Body() {
    const auto [found, added] = number_of_.try_emplace({object_, group_}, part_.bodies.size());
    if (added) {
      const std::string& name = object_.empty() ? group_ : object_;
      part_.bodies.push_back({name.empty() ? file_.stem().string() : name, {}, group_});
      numbers_.emplace_back();
    }
    return found->second;
  }

  /// A point of the file among those of a body.
  int NumberIn(std::size_t body, int point) {
    TriangleMesh& mesh = part_.bodies[body].mesh;
    const auto [found, added] = numbers_[body].try_emplace(point, static_cast<int>(mesh.points.size()));
    if (added) mesh.points.push_back(points_[static_cast<std::size_t>(point)]);
    return found->second;
  }

  const std::filesystem::path& file_;
  Lines lines_;
  std::vector<Eigen::Vector3d> points_;
  std::string object_;
  std::string group_;
  std::map<std::pair<std::string, std::string>, std::size_t> number_of_;
  std::vector<std::unordered_map<int, int>> numbers_;
  RawPart part_{"OBJ", {}, std::nullopt};
};

}  // namespace

RawPart ReadObj(const std::filesystem::path& file) { return ObjReader(file).Run(); }

std::int64_t CountObj(const std::filesystem::path& file, std::int64_t most) {
  Lines lines(file);
  std::int64_t count = 0;
  for (std::string line; count <= most && lines.Next(line);) {
    std::string_view rest(line);
    if (NextWord(rest) == "f") ++count;
  }
  return count;
}

}  // namespace feeler::cad
