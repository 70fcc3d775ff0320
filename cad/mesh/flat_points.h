#pragma once

#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// The same surface without the points that its shape does not need: those within a plane face, or on a straight edge
/// between two. Each goes into a neighbour (edge collapse) where no triangle around it leaves its plane by more than
/// 10 nm or turns over. Points that only several short edges beside a long one share stay. Deterministic; points must
/// be welded.
TriangleMesh WithoutFlatPoints(const TriangleMesh& mesh);

}  // namespace feeler::cad
