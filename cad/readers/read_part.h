#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// A unit of length that files come in.
struct Unit {
  std::string name;  ///< "mm"
  double metres = 0.001;
};
/// mm, cm, m, in, um. Throws InputError listing them for another name.
Unit ParseUnit(const std::string& name);

/// One body of a file, in the unit of the file.
struct RawBody {
  std::string name;
  TriangleMesh mesh;
  std::string group = {};  ///< of an OBJ file, within its object; else empty
};

/// What a file holds.
struct RawPart {
  std::string format;                   ///< "OBJ", "STEP" ...
  std::vector<RawBody> bodies;          ///< in the order of the file
  std::optional<Unit> unit;             ///< if the file, or its format, says so
  bool unit_is_stated = false;          ///< by the file itself: nothing else holds
  std::vector<std::string> notes = {};  ///< what was left out, a sentence each
};

/// More triangles than this are refused: what a part needs is a hundredth.
constexpr std::int64_t kMostTriangles = 1'000'000;
/// Throws the InputError of a file that has so many.
[[noreturn]] void TooMany(const std::filesystem::path& file, std::int64_t triangles);

/// Reads a STEP file as triangles (cad/step/).
using StepReader = std::function<RawPart(const std::filesystem::path&)>;

/// A file, and which of its bodies: "part.step", "part.step#2" (the second), "part.step#housing" (by its name, in OBJ
/// that of an object or of a group).
struct PartSource {
  std::filesystem::path file;
  std::string body;  ///< empty: all
};
PartSource ParseSource(const std::string& text);

/// Reads STL (ascii and binary), OBJ (all groups and objects), PLY and 3MF, and STEP by way of `step`. Throws
/// InputError for a file that is not there, is of another kind, empty or cut short, holds no triangles or too many.
RawPart ReadPart(const PartSource& source, const StepReader& step);

/// The unit of a part of this size in raw units, where the file does not say: metres up to 1, else millimetres. A
/// reason in words comes with it.
struct UnitGuess {
  Unit unit;
  std::string reason;
};
UnitGuess GuessUnit(const RawPart& part);

/// All bodies as one mesh, in metres.
TriangleMesh InMetres(const RawPart& part, const Unit& unit);

}  // namespace feeler::cad
