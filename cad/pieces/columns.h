#pragma once

#include <optional>
#include <vector>

#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/pieces/convex_piece.h"
#include "feeler/cad/pieces/decompose.h"
#include "feeler/cad/section/section.h"

namespace feeler::cad {

/// Of the tolerances, within which slabs for ColumnsOf are simplified: lines of two slabs then lie in each other within
/// two shares of it, and the solid's own within the third.
inline constexpr double kSimplifiedShare = 1.0 / 3;

/// A solid as convex bodies that stand on each other in columns: the slabs of a stretch whose cross-sections lie in
/// each other (a rounded rim, a dome, a bore that a slanting face cuts) share one partition, of the narrowest holes in
/// the widest outline; over each of its polygons as many slabs as the tolerances allow become one hull. A hull holds
/// all of the solid in its cell, so that nothing is lost; what it adds is judged by StaysInside. Nothing where that
/// takes more than `most` bodies, or one that is not allowed to be rough. `with_ends`: the ends of the slabs are
/// cross-sections, too, not their middles alone.
std::optional<std::vector<ConvexPiece>> ColumnsOf(const std::vector<Slab>& slabs, bool with_ends, const MeshTree& solid,
                                                  const DecomposeOptions& options, std::size_t most);

}  // namespace feeler::cad
