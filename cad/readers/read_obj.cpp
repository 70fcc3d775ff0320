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

#include "feeler/cad/readers/lines.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

/// Triangles of a plane polygon, by cutting off its ears (Meisters 1975); where none is left, as a fan.
class Ears {
 public:
  Ears(const std::vector<Eigen::Vector3d>& points, const std::vector<int>& face) : points_(points), left_(face) {
    // Newell's normal: that of a polygon that is not convex, too.
    for (std::size_t i = 0; i < face.size(); ++i) normal_ += At(i).cross(At((i + 1) % face.size()));
  }

  std::vector<std::array<int, 3>> Run() {
    std::vector<std::array<int, 3>> triangles;
    while (left_.size() > 3) {
      std::size_t ear = 1;
      while (ear <= left_.size() && !IsEar(ear % left_.size())) ++ear;
      if (ear > left_.size()) ear = 1;
      ear %= left_.size();
      triangles.push_back({left_[Before(ear)], left_[ear], left_[After(ear)]});
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    triangles.push_back({left_[0], left_[1], left_[2]});
    return triangles;
  }

 private:
  const Eigen::Vector3d& At(std::size_t i) const { return points_[static_cast<std::size_t>(left_[i])]; }
  std::size_t Before(std::size_t i) const { return (i + left_.size() - 1) % left_.size(); }
  std::size_t After(std::size_t i) const { return (i + 1) % left_.size(); }
  double Side(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& p) const {
    return normal_.dot((b - a).cross(p - a));
  }

  bool IsEar(std::size_t i) const {
    const Eigen::Vector3d& a = At(Before(i));
    const Eigen::Vector3d& b = At(i);
    const Eigen::Vector3d& c = At(After(i));
    if (Side(a, b, c) <= 0) return false;
    for (std::size_t k = 0; k < left_.size(); ++k) {
      if (k == i || k == Before(i) || k == After(i)) continue;
      const Eigen::Vector3d& p = At(k);
      if (Side(a, b, p) >= 0 && Side(b, c, p) >= 0 && Side(c, a, p) >= 0) return false;
    }
    return true;
  }

  const std::vector<Eigen::Vector3d>& points_;
  std::vector<int> left_;
  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero();
};

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
    const std::size_t body = Body();
    for (const auto& triangle : Ears(points_, face).Run()) {
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
