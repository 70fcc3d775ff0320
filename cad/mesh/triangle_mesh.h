#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "feeler/core/pose.h"

namespace feeler::cad {

/// A surface of triangles. Seen from outside, the corners of a triangle run counterclockwise.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> points;        ///< m
  std::vector<std::array<int, 3>> triangles;  ///< indices into `points`

  const Eigen::Vector3d& Corner(int triangle, int k) const {
    return points[static_cast<std::size_t>(triangles[static_cast<std::size_t>(triangle)][static_cast<std::size_t>(k)])];
  }
  int size() const { return static_cast<int>(triangles.size()); }
};

using Box = Eigen::AlignedBox3d;

Box BoundsOf(const TriangleMesh& mesh);
/// The box around one triangle.
Box BoundsOf(const TriangleMesh& mesh, int triangle);
/// Twice the area, along the outward normal.
Eigen::Vector3d AreaVector(const TriangleMesh& mesh, int triangle);
/// Signed: negative where the triangles are seen from inside.
double VolumeOf(const TriangleMesh& mesh);
double AreaOf(const TriangleMesh& mesh);

TriangleMesh Transformed(const TriangleMesh& mesh, const Pose& pose);
TriangleMesh Scaled(const TriangleMesh& mesh, double factor);
void Append(const TriangleMesh& more, TriangleMesh& mesh);

/// Points nearer than `tolerance_m` become one, triangles that lose their area go, and so do points that nothing uses.
/// The order of what stays is that of the input.
TriangleMesh Welded(const TriangleMesh& mesh, double tolerance_m);

/// Shells: triangles that share points, each a mesh of its own, in the order of their first triangles. Points must be
/// welded.
std::vector<TriangleMesh> ShellsOf(const TriangleMesh& mesh);

}  // namespace feeler::cad
