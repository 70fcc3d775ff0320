#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <vector>

#include "core/pose.h"

namespace feeler::env {

/// A convex geom, placed in a frame and known by its support points (metres). A mesh stands for its convex hull, as in
/// MuJoCo. Planes and height fields are not shapes of this kind.
class ConvexShape {
 public:
  ConvexShape(const mjModel& model, int geom, const Pose& frame_T_geom);

  /// The point of the shape farthest along `direction` (need not be a unit vector, must not be zero).
  Eigen::Vector3d Support(const Eigen::Vector3d& direction) const;
  /// A point inside.
  Eigen::Vector3d center() const { return pose_.translation(); }
  /// A box whose edges are parallel to the axes of the frame.
  bool is_aligned_box() const { return is_aligned_box_; }

 private:
  Eigen::Vector3d LocalSupport(const Eigen::Vector3d& direction) const;

  int type_;
  Eigen::Vector3d size_;
  Pose pose_;
  std::vector<Eigen::Vector3d> hull_;  ///< of a mesh, in the frame
  bool is_aligned_box_ = false;
};

/// Pose of a geom in the frame of `body`, which is the geom's body or an ancestor of it; joints at rest.
Pose GeomInBody(const mjModel& model, int geom, int body);

/// Vertices of the convex hull of a mesh geom, in the frame of the geom.
std::vector<Eigen::Vector3d> MeshHull(const mjModel& model, int geom);

}  // namespace feeler::env
