#pragma once

#include <Eigen/Core>
#include <vector>

#include "feeler/cad/pieces/convex_piece.h"

namespace feeler::cad {

using Polygon3 = std::vector<Eigen::Vector3d>;

/// The part of a planar convex polygon with normal . x <= offset; empty when nothing, or no more than a corner, is
/// left.
Polygon3 Clip(const Polygon3& polygon, const Eigen::Vector3d& normal, double offset_m);
/// Whether all of it is within a half-space whose plane is moved outward by `grow_m`.
bool IsWithin(const Polygon3& polygon, const HalfSpace& plane, double grow_m);
/// The part of it within half-spaces whose planes are all moved outward by `grow_m`.
Polygon3 ClipToPlanes(Polygon3 polygon, const std::vector<HalfSpace>& planes, double grow_m);
/// The part of it within a piece whose planes are all moved outward by `grow_m`.
Polygon3 ClipToPiece(Polygon3 polygon, const ConvexPiece& piece, double grow_m);
/// The parts of it outside of such a piece, convex and apart.
std::vector<Polygon3> Outside(const Polygon3& polygon, const ConvexPiece& piece, double grow_m);
Polygon3 ClipToBox(Polygon3 polygon, const Box& box);

}  // namespace feeler::cad
