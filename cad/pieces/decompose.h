#pragma once

#include <optional>
#include <string>
#include <vector>

#include "feeler/cad/mesh/triangle_mesh.h"
#include "feeler/cad/pieces/convex_piece.h"

namespace feeler::cad {

struct DecomposeOptions {
  Box mating;                      ///< where tool and target mate; the slabs are cut across z
  double tolerance_near_m = 1e-6;  ///< of the surface in the box
  double tolerance_far_m = 1e-6;   ///< elsewhere
  int most_levels = 640;           ///< beyond it, a free form is not sliced at all of its heights
  int most_slabs = 160;            ///< beyond it, slabs of a free form are drawn together
  bool rough = true;  ///< a column that no hull fits however it is halved is taken as it comes; else none is
};

/// A solid as convex bodies whose union is the solid. One that is convex is one body; else the part is sliced along z
/// at the heights of its corners, each slice is cut into convex polygons (cad/section/convex_partition.h), and the
/// bodies over them are united as long as the convex hull of two stays in the solid, within the tolerances. Exact for
/// prisms, bores, tapers and rings along z. Same input, same pieces, bit for bit.
std::vector<ConvexPiece> Decompose(const TriangleMesh& solid, const DecomposeOptions& options);
/// The same, or in columns (columns.h) where the slices have more than `most_bodies` before they are united, or more
/// than `most_pieces` are left; nothing where that many are left of the columns, too.
std::optional<std::vector<ConvexPiece>> DecomposeIfFew(const TriangleMesh& solid, const DecomposeOptions& options,
                                                       std::size_t most_bodies, std::size_t most_pieces);

}  // namespace feeler::cad
