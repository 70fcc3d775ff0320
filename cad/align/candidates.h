#pragma once

#include <Eigen/Core>
#include <vector>

#include "feeler/cad/align/profile.h"
#include "feeler/cad/mesh/triangle_mesh.h"
#include "feeler/cad/section/section.h"

namespace feeler::cad {

/// Directions that the shape of a part has: the normals of its larger flat faces, and those in which most of the length
/// of its edges runs, as along the sides of a bore or a slot. Unit vectors, one way, no two within half a degree.
std::vector<Eigen::Vector3d> ShapeDirections(const TriangleMesh& mesh);

/// Directions along which a part may be meant to move: the axes of its CAD frame, and those of its shape; both ways.
std::vector<Eigen::Vector3d> CandidateDirections(const TriangleMesh& mesh);

/// The rotation that brings `direction` to +z by the shortest way, exactly for axes.
Eigen::Matrix3d RotationToZ(const Eigen::Vector3d& direction);

/// A line around material or around a hole, over a range of heights.
struct Feature {
  bool hole = false;
  double low_m = 0.0;
  double high_m = 0.0;
  SlabLoop loop;           ///< half-way
  SlabLoop low_loop;       ///< its lower end, as the `middle` of its points; set if it tapers
  SlabLoop high_loop;      ///< its upper end
  int tapers = 0;          ///< 1: it widens upwards, -1: downwards
  double lean = 0.0;       ///< how far it moves sideways, over its height
  double area = 0.0;       ///< m^2, positive; half-way
  double edge_rad = 0.0;   ///< direction in which most of its length runs, modulo half a turn
  bool has_edges = false;  ///< else no direction stands out
  Profile profile;         ///< half-way
};

/// The loops of a part whose cross-sections across z are looked at at its thicker slabs.
std::vector<Feature> FeaturesOf(const TriangleMesh& mesh);

}  // namespace feeler::cad
