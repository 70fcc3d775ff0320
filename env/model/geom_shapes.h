#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <array>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/planner/contact/convex_shape.h"

namespace feeler::env {

/// Pose of a geom in the frame of `body`, which is the geom's body or an ancestor of it; joints at rest.
Pose GeomInBody(const mjModel& model, int geom, int body);

/// Vertices of the convex hull of a mesh geom, in the geom's frame, metres.
std::vector<Eigen::Vector3d> MeshHull(const mjModel& model, int geom);

/// A convex geom as data, placed in a frame. A mesh stands for its convex hull, as in MuJoCo. Planes and height fields
/// are not pieces of this kind.
planner::ConvexPiece PieceOf(const mjModel& model, int geom, const Pose& frame_T_geom);

/// Smallest and largest coordinate of a body's geoms along a direction, in the body's frame. Planes are left out.
std::array<double, 2> SpanOf(const mjModel& model, const std::vector<int>& geoms, int body,
                             const Eigen::Vector3d& along);

}  // namespace feeler::env
