#pragma once

#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/pieces/convex_piece.h"
#include "feeler/cad/pieces/decompose.h"

namespace feeler::cad {

/// Whether the surface of the solid does not enter a hull by more than the tolerances.
bool StaysInside(const ConvexPiece& hull, const MeshTree& solid, const DecomposeOptions& options);
/// Whether a surface may enter a hull less deep than the tolerances say, because the hull is thin.
bool IsThin(const ConvexPiece& hull, const DecomposeOptions& options);

}  // namespace feeler::cad
