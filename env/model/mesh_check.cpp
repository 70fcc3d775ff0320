#include "feeler/env/model/mesh_check.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/model/task_xml.h"

namespace feeler::env {
namespace {

using Points = std::vector<Eigen::Vector3d>;

/// A share of the largest extent below which a mesh counts as flat.
constexpr double kFlat = 1e-6;

/// The numbers that a text begins with.
std::vector<double> Numbers(std::string_view text) {
  std::vector<double> numbers;
  while (true) {
    const std::size_t begin = text.find_first_not_of(" \t\r\n,");
    if (begin == std::string_view::npos) return numbers;
    text.remove_prefix(begin);
    if (text.front() == '+') text.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc()) return numbers;
    numbers.push_back(value);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  }
}

Points Triples(const std::vector<double>& numbers) {
  Points points;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return points;
}

void ForLines(std::string_view text, const std::function<void(std::string_view line)>& visit) {
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    visit(text.substr(0, end));
    if (end == std::string_view::npos) return;
    text.remove_prefix(end + 1);
  }
}

struct ObjContent {
  Points vertices;
  std::vector<std::string> objects;  ///< that have faces; "" for what stands before the first
};

ObjContent ReadObj(std::string_view text) {
  ObjContent content;
  std::string object;
  bool counted = false;
  ForLines(text, [&](std::string_view line) {
    if (line.starts_with("v ") || line.starts_with("v\t")) {
      const std::vector<double> v = Numbers(line.substr(2));
      if (v.size() >= 3) content.vertices.emplace_back(v[0], v[1], v[2]);
    } else if (line.starts_with("o ") || line.starts_with("g ")) {
      object = line.substr(2);
      while (!object.empty() && std::isspace(static_cast<unsigned char>(object.back())) != 0) object.pop_back();
      counted = false;
    } else if (line.starts_with("f ") && !counted) {
      content.objects.push_back(object);
      counted = true;
    }
  });
  return content;
}

Points ReadBinaryStl(std::string_view bytes) {
  Points points;
  std::uint32_t facets = 0;
  if (bytes.size() < 84) return points;
  std::memcpy(&facets, bytes.data() + 80, sizeof(facets));
  if (84 + std::uint64_t{50} * facets != bytes.size()) return points;  // MuJoCo has to say what is wrong with it
  for (std::uint64_t i = 0; i < facets && 84 + 50 * (i + 1) <= bytes.size(); ++i) {
    for (std::size_t corner = 1; corner < 4; ++corner) {
      float v[3];
      std::memcpy(v, bytes.data() + 84 + 50 * i + 12 * corner, sizeof(v));
      points.emplace_back(v[0], v[1], v[2]);
    }
  }
  return points;
}

std::string Extension(const std::string& file) {
  std::string extension = std::filesystem::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

/// The text of a mesh file; empty where MuJoCo has to say what is wrong with it.
std::string BytesOf(const std::string& file) {
  try {
    return ReadTextFile(file);
  } catch (const InputError&) {
    return "";
  }
}

std::optional<Points> VerticesOf(const tinyxml2::XMLElement& mesh) {
  if (const char* vertices = mesh.Attribute("vertex")) return Triples(Numbers(vertices));
  const char* file = mesh.Attribute("file");
  if (file == nullptr) return std::nullopt;
  const std::string extension = Extension(file);
  Points points;
  if (extension == ".obj") points = ReadObj(BytesOf(file)).vertices;
  if (extension == ".stl") points = ReadBinaryStl(BytesOf(file));
  return points.empty() ? std::nullopt : std::optional(points);
}

/// Thickness in the direction in which the points spread least.
double Thickness(const Points& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const Eigen::Vector3d thin = solver.eigenvectors().col(0);
  double low = 0;
  double high = 0;
  for (const Eigen::Vector3d& p : points) {
    low = std::min(low, thin.dot(p - mean));
    high = std::max(high, thin.dot(p - mean));
  }
  return high - low;
}

double Extent(const Points& points) {
  Eigen::Vector3d low = points.front();
  Eigen::Vector3d high = low;
  for (const Eigen::Vector3d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).maxCoeff();
}

std::string Element(const tinyxml2::XMLElement& mesh, const std::string& where) {
  const char* name = mesh.Attribute("name");
  const char* file = mesh.Attribute("file");
  return fmt::format("{}: <mesh{}{}>", where, name == nullptr ? "" : fmt::format(" name=\"{}\"", name),
                     file == nullptr ? "" : fmt::format(" file=\"{}\"", file));
}

void ForMeshes(const std::string& xml, const std::function<void(const tinyxml2::XMLElement& mesh)>& visit) {
  tinyxml2::XMLDocument document;
  if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) return;
  const tinyxml2::XMLElement* mujoco = document.FirstChildElement("mujoco");
  if (mujoco == nullptr) return;
  for (auto* asset = mujoco->FirstChildElement("asset"); asset != nullptr; asset = asset->NextSiblingElement("asset")) {
    for (auto* mesh = asset->FirstChildElement("mesh"); mesh != nullptr; mesh = mesh->NextSiblingElement("mesh")) {
      visit(*mesh);
    }
  }
}

}  // namespace

void RequireSoundMeshes(const std::string& xml, const std::string& where) {
  ForMeshes(xml, [&](const tinyxml2::XMLElement& mesh) {
    const std::optional<Points> points = VerticesOf(mesh);
    if (!points) return;
    const auto refuse = [&](const std::string& what) {
      throw InputError(Element(mesh, where), what, "give a closed surface that encloses a volume");
    };
    if (points->size() < 4) refuse(fmt::format("{} vertices enclose no volume", points->size()));
    for (const Eigen::Vector3d& p : *points) {
      if (!p.allFinite()) refuse("a vertex is not finite");
    }
    const double extent = Extent(*points);
    const double thickness = Thickness(*points);
    if (!(thickness > kFlat * extent)) {
      refuse(fmt::format("its {} vertices lie in a plane, a line or a point ({:.3g} thick, {:.3g} long)",
                         points->size(), thickness, extent));
    }
  });
}

TaskFindings MeshFindings(const std::string& xml, const std::string& where) {
  TaskFindings findings;
  ForMeshes(xml, [&](const tinyxml2::XMLElement& mesh) {
    const char* file = mesh.Attribute("file");
    if (file == nullptr || Extension(file) != ".obj") return;
    const std::vector<std::string> objects = ReadObj(BytesOf(file)).objects;
    if (objects.size() < 2) return;
    std::string names;
    for (std::size_t i = 0; i < std::min<std::size_t>(objects.size(), 5); ++i) {
      names += (i == 0 ? "" : ", ") + (objects[i].empty() ? "unnamed" : objects[i]);
    }
    findings.push_back({TaskFinding::Severity::kError, "objects", Element(mesh, where),
                        fmt::format("holds {} objects ({}{}), of which MuJoCo reads only the first: {} would be lost",
                                    objects.size(), names, objects.size() > 5 ? ", ..." : "", objects.size() - 1),
                        "write each object to a file of its own, with a <mesh> and a <geom> each"});
  });
  return findings;
}

}  // namespace feeler::env
