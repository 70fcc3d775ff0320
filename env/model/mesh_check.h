#pragma once

#include <string>

#include "feeler/env/model/task_finding.h"

namespace feeler::env {

/// Throws InputError, naming the mesh and its file, where the vertices of a mesh asset (inline, OBJ or STL) span no
/// volume or are not numbers: MuJoCo's convex hull fails on them with pages of text. `xml`: file names absolute.
void RequireSoundMeshes(const std::string& xml, const std::string& where);

/// Mesh files of which MuJoCo reads a part only: OBJ files of several objects, of which it takes the first.
TaskFindings MeshFindings(const std::string& xml, const std::string& where);

}  // namespace feeler::env
