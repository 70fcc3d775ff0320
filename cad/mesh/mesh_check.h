#pragma once

#include <string>
#include <vector>

#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// A part whose surface was checked, and mended where that cannot change its shape.
struct CheckedPart {
  TriangleMesh mesh;                 ///< all shells, closed, seen from outside
  std::vector<TriangleMesh> solids;  ///< a mesh for each solid, hollows included
  std::vector<std::string> mended;   ///< what was done, a sentence each
  std::vector<std::string> noted;    ///< what was found and left
};

/// Welds points, drops triangles without area, those that are there twice and points that the shape does not need
/// (flat_points.h), turns shells that are seen from inside, and checks that the surface is closed: every edge is met
/// from both sides, by one long edge or by several short ones. `where` names the part in messages. Throws InputError
/// with the place for a surface that is open, has no thickness, cuts itself, or is of no consistent orientation.
CheckedPart CheckPart(const TriangleMesh& mesh, const std::string& where);

}  // namespace feeler::cad
