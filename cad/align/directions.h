#pragma once

#include <Eigen/Core>
#include <vector>

#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// Directions that the shape of a part has: the normals of its larger flat faces, and those in which most of the length
/// of its edges runs, as along the sides of a bore or a slot. Unit vectors, one way, no two within half a degree.
std::vector<Eigen::Vector3d> ShapeDirections(const TriangleMesh& mesh);

/// Directions along which a part may be meant to move: the axes of its CAD frame, and those of its shape; both ways.
std::vector<Eigen::Vector3d> CandidateDirections(const TriangleMesh& mesh);

/// The rotation that brings `direction` to +z by the shortest way, exactly for axes.
Eigen::Matrix3d RotationToZ(const Eigen::Vector3d& direction);

}  // namespace feeler::cad
