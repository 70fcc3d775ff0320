#include "feeler/cad/readers/read_part.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <charconv>
#include <cstring>
#include <fstream>
#include <string_view>

#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

namespace fs = std::filesystem;

std::string Extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

[[noreturn]] void TooMany(const fs::path& file, std::int64_t triangles) {
  throw InputError(file.string(), fmt::format("has {} triangles, more than {}", triangles, kMostTriangles),
                   "export it coarser: a part needs some thousands");
}

/// Counts the facets of a text file without reading it into memory.
std::int64_t CountLines(const fs::path& file, std::string_view keyword) {
  std::ifstream in(file);
  std::int64_t count = 0;
  for (std::string line; std::getline(in, line);) {
    const std::size_t begin = line.find_first_not_of(" \t");
    if (begin == std::string::npos || line.compare(begin, keyword.size(), keyword) != 0) continue;
    const std::size_t after = begin + keyword.size();
    if (after < line.size() && (line[after] == ' ' || line[after] == '\t')) ++count;
    if (count > kMostTriangles) break;
  }
  return count;
}

/// A binary STL is as long as its count says; many begin with "solid" all the same.
std::optional<std::int64_t> BinaryStlTriangles(const fs::path& file) {
  std::error_code error;
  const auto size = static_cast<std::int64_t>(fs::file_size(file, error));
  if (error || size < 84) return std::nullopt;
  std::ifstream in(file, std::ios::binary);
  in.seekg(80);
  std::array<unsigned char, 4> bytes{};
  in.read(reinterpret_cast<char*>(bytes.data()), 4);
  const std::int64_t count = bytes[0] + 256LL * bytes[1] + 65536LL * bytes[2] + 16777216LL * bytes[3];
  if (84 + 50 * count != size) return std::nullopt;
  return count;
}

void RequireModest(const fs::path& file, const std::string& extension) {
  std::int64_t triangles = 0;
  if (extension == ".stl") {
    const auto binary = BinaryStlTriangles(file);
    triangles = binary ? *binary : CountLines(file, "facet");
  } else if (extension == ".obj") {
    triangles = CountLines(file, "f");
  } else {
    std::error_code error;
    triangles = static_cast<std::int64_t>(fs::file_size(file, error)) / 12;  // three indices of four bytes at the least
    if (error || triangles < 40 * kMostTriangles) return;
  }
  if (triangles > kMostTriangles) TooMany(file, triangles);
}

float FloatAt(const char* bytes) {
  float value = 0;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

RawPart ReadBinaryStl(const fs::path& file, std::int64_t triangles) {
  std::ifstream in(file, std::ios::binary);
  in.seekg(84);
  RawBody body{file.stem().string(), {}};
  std::array<char, 50> facet{};
  for (std::int64_t t = 0; t < triangles && in.read(facet.data(), facet.size()); ++t) {
    std::array<int, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const char* at = facet.data() + 12 + 12 * k;
      corners[k] = static_cast<int>(body.mesh.points.size());
      body.mesh.points.emplace_back(FloatAt(at), FloatAt(at + 4), FloatAt(at + 8));
    }
    body.mesh.triangles.push_back(corners);
  }
  return {"STL, binary", {std::move(body)}, std::nullopt};
}

/// The next number of a line; false at its end. Locales play no part.
bool NextNumber(std::string_view& rest, double& value) {
  const std::size_t begin = rest.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return false;
  rest.remove_prefix(begin + (rest[begin] == '+' ? 1 : 0));
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc()) return false;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return true;
}

RawPart ReadAsciiStl(const fs::path& file) {
  std::ifstream in(file);
  RawBody body{file.stem().string(), {}};
  int number = 0;
  int corners = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const std::size_t begin = line.find_first_not_of(" \t");
    if (begin == std::string::npos) continue;
    if (line.compare(begin, 6, "vertex") == 0) {
      std::string_view rest(line);
      rest.remove_prefix(begin + 6);
      Eigen::Vector3d p;
      for (int k = 0; k < 3; ++k) {
        if (!NextNumber(rest, p[k])) {
          throw InputError(fmt::format("{}:{}", file.string(), number), "a vertex has not three numbers",
                           "export it again");
        }
      }
      body.mesh.points.push_back(p);
      ++corners;
    } else if (line.compare(begin, 7, "endloop") == 0) {
      if (corners != 3) {
        throw InputError(fmt::format("{}:{}", file.string(), number), fmt::format("a facet of {} corners", corners),
                         "export triangles");
      }
      const int last = static_cast<int>(body.mesh.points.size());
      body.mesh.triangles.push_back({last - 3, last - 2, last - 1});
      corners = 0;
    }
  }
  return {"STL, ascii", {std::move(body)}, std::nullopt};
}

/// OBJ: every face of every group and object, polygons as fans (assimp triangulates those that are not convex, but its
/// reader drops faces of degenerate groups; the format is a page long).
RawPart ReadObj(const fs::path& file) {
  std::ifstream in(file);
  std::vector<Eigen::Vector3d> points;
  RawPart part{"OBJ", {}, std::nullopt};
  std::string name = file.stem().string();
  int number = 0;
  RawBody body{name, {}};
  for (std::string line; std::getline(in, line);) {
    ++number;
    const auto fail = [&](const std::string& what) {
      throw InputError(fmt::format("{}:{}", file.string(), number), what, "export it again");
    };
    std::string_view rest(line);
    if (rest.starts_with("v ")) {
      rest.remove_prefix(2);
      Eigen::Vector3d p;
      for (int k = 0; k < 3; ++k) {
        if (!NextNumber(rest, p[k])) fail("a vertex has not three numbers");
      }
      points.push_back(p);
    } else if (rest.starts_with("f ")) {
      rest.remove_prefix(2);
      std::vector<int> face;
      double value = 0;
      while (NextNumber(rest, value)) {
        const int index = static_cast<int>(value < 0 ? static_cast<double>(points.size()) + value : value - 1);
        if (index < 0 || index >= static_cast<int>(points.size())) fail(fmt::format("a face names vertex {}", value));
        face.push_back(index);
        const std::size_t space = rest.find_first_of(" \t");
        rest.remove_prefix(space == std::string_view::npos ? rest.size() : space);
      }
      if (face.size() < 3) fail("a face of fewer than three corners");
      for (std::size_t k = 1; k + 1 < face.size(); ++k) body.mesh.triangles.push_back({face[0], face[k], face[k + 1]});
    }
  }
  body.mesh.points = std::move(points);
  part.bodies.push_back(std::move(body));
  return part;
}

RawPart ReadWithAssimp(const fs::path& file, const std::string& format) {
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_LINE | aiPrimitiveType_POINT);
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_PreTransformVertices);
  if (scene == nullptr) throw InputError(file.string(), importer.GetErrorString(), "export it again, or as STL");
  RawPart part{format, {}, std::nullopt};
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    RawBody body{mesh.mName.length > 0 ? mesh.mName.C_Str() : fmt::format("body {}", m + 1), {}};
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      body.mesh.points.emplace_back(p.x, p.y, p.z);
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;
      body.mesh.triangles.push_back(
          {static_cast<int>(face.mIndices[0]), static_cast<int>(face.mIndices[1]), static_cast<int>(face.mIndices[2])});
    }
    if (!body.mesh.triangles.empty()) part.bodies.push_back(std::move(body));
  }
  return part;
}

RawPart ReadAll(const fs::path& file, const StepReader& step) {
  const std::string extension = Extension(file);
  if (extension == ".step" || extension == ".stp") return step(file);
  if (extension != ".stl" && extension != ".obj" && extension != ".ply" && extension != ".3mf") {
    throw InputError(file.string(), fmt::format("\"{}\" is no format that is read", extension),
                     "give STEP, STL, OBJ, PLY or 3MF");
  }
  RequireModest(file, extension);
  if (extension == ".obj") return ReadObj(file);
  if (extension == ".stl") {
    const auto binary = BinaryStlTriangles(file);
    return binary ? ReadBinaryStl(file, *binary) : ReadAsciiStl(file);
  }
  RawPart part = ReadWithAssimp(file, extension == ".ply" ? "PLY" : "3MF");
  if (extension == ".3mf") part.unit = ParseUnit("mm");  // what the format means where it does not say another
  return part;
}

void KeepBody(const PartSource& source, RawPart& part) {
  if (source.body.empty()) return;
  std::string names;
  for (std::size_t i = 0; i < part.bodies.size(); ++i) {
    const RawBody& body = part.bodies[i];
    if (body.name == source.body || std::to_string(i + 1) == source.body) {
      part.bodies = {RawBody(body)};
      return;
    }
    names += fmt::format("{}{} \"{}\"", i == 0 ? "" : ", ", i + 1, body.name);
  }
  throw InputError(source.file.string(), fmt::format("has no body \"{}\"", source.body), "it has " + names);
}

}  // namespace

Unit ParseUnit(const std::string& name) {
  for (const Unit& unit : {Unit{"mm", 1e-3}, Unit{"cm", 1e-2}, Unit{"m", 1.0}, Unit{"in", 0.0254}, Unit{"um", 1e-6}}) {
    if (unit.name == name) return unit;
  }
  throw InputError("--unit", fmt::format("unknown unit \"{}\"", name), "choose one of mm, cm, m, in, um");
}

PartSource ParseSource(const std::string& text) {
  // A file whose name holds a '#' is taken by its name.
  std::error_code error;
  const std::size_t hash = text.rfind('#');
  if (hash == std::string::npos || fs::exists(text, error)) return {text, ""};
  return {text.substr(0, hash), text.substr(hash + 1)};
}

RawPart ReadPart(const PartSource& source, const StepReader& step) {
  std::error_code error;
  if (!fs::is_regular_file(source.file, error)) {
    throw InputError(source.file.string(), "is not a file", "give a STEP, STL, OBJ, PLY or 3MF file");
  }
  RawPart part = ReadAll(source.file, step);
  std::int64_t triangles = 0;
  for (const RawBody& body : part.bodies) triangles += body.mesh.size();
  if (triangles == 0) throw InputError(source.file.string(), "holds no triangles", "export a solid or a closed mesh");
  if (triangles > kMostTriangles) TooMany(source.file, triangles);
  KeepBody(source, part);
  return part;
}

UnitGuess GuessUnit(const RawPart& part) {
  if (part.unit) return {*part.unit, fmt::format("the file is in {}", part.unit->name)};
  Box box;
  for (const RawBody& body : part.bodies) {
    // Points that no triangle uses do not count.
    for (const auto& t : body.mesh.triangles) {
      for (const int k : t) box.extend(body.mesh.points[static_cast<std::size_t>(k)]);
    }
  }
  const double size = box.diagonal().norm();
  const Unit unit = ParseUnit(size < 1.0 ? "m" : "mm");
  return {unit, fmt::format("guessed: {:.4g} across, a part of {:.4g} mm if that is in {} (--unit settles it)", size,
                            1000 * size * unit.metres, unit.name)};
}

TriangleMesh InMetres(const RawPart& part, const Unit& unit) {
  TriangleMesh all;
  for (const RawBody& body : part.bodies) Append(body.mesh, all);
  for (Eigen::Vector3d& point : all.points) point *= unit.metres;
  return all;
}

}  // namespace feeler::cad
