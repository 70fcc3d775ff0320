#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// The half-space normal . x <= offset.
struct HalfSpace {
  Eigen::Vector3d normal;  ///< unit, outward
  double offset_m = 0.0;
};

/// A convex body: what MuJoCo takes for a mesh geom.
struct ConvexPiece {
  TriangleMesh surface;           ///< its hull, seen from outside
  std::vector<HalfSpace> planes;  ///< one for each face; triangles of one face share theirs
  double volume = 0.0;            ///< m^3
  Box bounds;
};

/// The convex hull of points (Qhull); empty where they have no volume.
std::optional<ConvexPiece> HullOf(const std::vector<Eigen::Vector3d>& points);

/// The piece with fewer corners: those are left out that stay within the tolerance at their place of the faces of the
/// rest.
ConvexPiece WithFewerCorners(const ConvexPiece& piece,
                             const std::function<double(const Eigen::Vector3d&)>& tolerance_at);

/// 0 inside, else the distance to the piece, m.
double DistanceTo(const ConvexPiece& piece, const Eigen::Vector3d& point);

/// Whether the piece is a box along the axes.
bool IsAlignedBox(const ConvexPiece& piece);

}  // namespace feeler::cad
