#pragma once

#include <vector>

#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/pieces/convex_piece.h"
#include "feeler/cad/pieces/decompose.h"

namespace feeler::cad {

/// Convex bodies of a solid, united as long as the convex hull of two is little more than both and stays in the solid
/// (stays_inside.h): first what stands on each other, then side by side. Same bodies in the same order, same result.
std::vector<ConvexPiece> United(std::vector<ConvexPiece> pieces, const MeshTree& solid,
                                const DecomposeOptions& options);

}  // namespace feeler::cad
