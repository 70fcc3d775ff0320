#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>

#include "feeler/cad/mesh/box_tree.h"
#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// The point of a triangle that is nearest to `p` (Ericson 2005, section 5.1.5).
Eigen::Vector3d ClosestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c);

/// A tree of boxes over the triangles of a mesh, which must outlive it. Immutable; shared by threads.
class MeshTree {
 public:
  explicit MeshTree(const TriangleMesh& mesh);

  /// Distance from `p` to the surface, m; `most_m` where it is no less.
  double Distance(const Eigen::Vector3d& p, double most_m = std::numeric_limits<double>::infinity()) const;
  /// Whether `p` is inside: a ray crosses the surface outward more often than inward; of three skew rays the majority
  /// decides. Cracks of no width, as where a long edge meets two short ones, do no harm.
  bool Inside(const Eigen::Vector3d& p) const;
  /// 0 inside, else the distance to the surface.
  double DistanceToSolid(const Eigen::Vector3d& p) const { return Inside(p) ? 0.0 : Distance(p); }
  /// Calls `visit` for each triangle whose box meets `box`, until it returns false.
  void Visit(const Box& box, const std::function<bool(int)>& visit) const;

  const TriangleMesh& mesh() const { return mesh_; }
  const BoxTree& boxes() const { return tree_; }  ///< of the triangles

 private:
  int Crossings(const Eigen::Vector3d& p, const Eigen::Vector3d& direction) const;

  const TriangleMesh& mesh_;
  BoxTree tree_;
};

}  // namespace feeler::cad
