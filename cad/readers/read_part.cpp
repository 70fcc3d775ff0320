#include "feeler/cad/readers/read_part.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <string_view>
#include <system_error>
#include <utility>

#include "feeler/cad/readers/lines.h"
#include "feeler/cad/readers/read_apart.h"
#include "feeler/cad/readers/read_obj.h"
#include "feeler/cad/readers/read_ply.h"
#include "feeler/cad/readers/read_stl.h"
#include "feeler/cad/readers/zip_model.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

namespace fs = std::filesystem;

std::string Extension(const fs::path& file) { return Lower(file.extension().string()); }

/// No triangle of a 3MF model takes fewer bytes than `<triangle v1="0" v2="1" v3="2"/>`, and half a vertex.
std::int64_t Count3mf(const fs::path& file) {
  constexpr std::int64_t kLeastBytes = 50;
  const std::optional<ZipModel> model = PeekZipModel(file);
  return model ? static_cast<std::int64_t>(model->bytes) / kLeastBytes : 0;
}

void RequireModest(const fs::path& file, const std::string& extension) {
  std::int64_t triangles = 0;
  if (extension == ".stl") {
    triangles = CountStl(file, kMostTriangles);
  } else if (extension == ".obj") {
    triangles = CountObj(file, kMostTriangles);
  } else if (extension == ".3mf") {
    triangles = Count3mf(file) / 2;  // they may take twice as many
  }
  if (triangles > kMostTriangles) TooMany(file, triangles);
}

RawPart Read3mfHere(const fs::path& file) {
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_LINE | aiPrimitiveType_POINT);
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_PreTransformVertices);
  if (scene == nullptr) throw Refusal{importer.GetErrorString(), "export it again, or as STL"};
  RawPart part{"3MF", {}, ParseUnit("mm")};  // what the format means where it does not say another
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    RawBody body{mesh.mName.length > 0 ? mesh.mName.C_Str() : fmt::format("body {}", m + 1), {}, {}};
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
  const std::optional<ZipModel> model = PeekZipModel(file);
  if (const auto unit = model ? UnitOfModel(model->head) : std::nullopt) {
    part.unit = Unit{unit->name, unit->metres};
    part.unit_is_stated = true;
  }
  return part;
}

RawPart Read3mf(const fs::path& file) {
  return ReadApart(file, "assimp", [&] { return Read3mfHere(file); });
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
  if (extension == ".stl") return ReadStl(file);
  return extension == ".ply" ? ReadPly(file) : Read3mf(file);
}

void KeepBody(const PartSource& source, RawPart& part) {
  if (source.body.empty()) return;
  std::vector<RawBody> kept;
  for (const RawBody& body : part.bodies) {
    if (body.name == source.body || body.group == source.body) kept.push_back(body);
  }
  std::string names;
  for (std::size_t i = 0; i < part.bodies.size(); ++i) {
    const RawBody& body = part.bodies[i];
    if (kept.empty() && std::to_string(i + 1) == source.body) kept.push_back(body);
    const bool grouped = !body.group.empty() && body.group != body.name;
    names += fmt::format("{}{} \"{}\"{}", i == 0 ? "" : ", ", i + 1, body.name,
                         grouped ? fmt::format(" (group \"{}\")", body.group) : "");
  }
  if (!kept.empty()) {
    part.bodies = std::move(kept);
    return;
  }
  throw InputError(source.file.string(), fmt::format("has no body \"{}\"", source.body), "it has " + names);
}

}  // namespace

void TooMany(const fs::path& file, std::int64_t triangles) {
  throw InputError(file.string(), fmt::format("has {} triangles, more than {}", triangles, kMostTriangles),
                   "export it coarser: a part needs some thousands");
}

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
