#pragma once

#include <filesystem>
#include <string>

#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// Writes a mesh as it stands. `format`: "stl" and "ply" (binary), "stl-ascii", "ply-ascii", "obj" or "3mf" (which
/// states millimetres).
void WriteMesh(const TriangleMesh& mesh, const std::filesystem::path& file, const std::string& format);

}  // namespace feeler::cad
