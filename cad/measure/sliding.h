#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// Slides one mesh against another: exactly, for two surfaces of triangles first touch corner on face, face on corner
/// or edge on edge. Both meshes must outlive it. Immutable; shared by threads.
class MeshSlide {
 public:
  MeshSlide(const TriangleMesh& tool, const MeshTree& target) : tool_(tool), target_(target) {}

  /// How far the tool, moved by `offset_m`, travels along `direction` (unit) before it touches the target, at most
  /// `most_m` (which is returned when nothing is met). Surfaces that slide along each other do not stop it.
  double Travel(const Eigen::Vector3d& offset_m, const Eigen::Vector3d& direction, double most_m) const;

  /// Whether the surfaces cut each other with the tool moved by `offset_m`, or one part is inside of the other.
  bool Overlap(const Eigen::Vector3d& offset_m) const;

 private:
  double TravelUpTo(const Eigen::Vector3d& offset_m, const Eigen::Vector3d& direction, double most_m) const;

  const TriangleMesh& tool_;
  const MeshTree& target_;
};

/// Whether two triangles cut each other; coplanar ones do not.
bool TrianglesCut(const std::array<Eigen::Vector3d, 3>& a, const std::array<Eigen::Vector3d, 3>& b);

}  // namespace feeler::cad
