#pragma once

#include <Eigen/Core>
#include <optional>

#include "feeler/planner/contact/convex_shape.h"

namespace feeler::planner {

/// Where along a line the obstacle lies: low < t < high, metres. `slope` is the cosine between the line and the outward
/// normal of the surface at that end: 1 for a wall across the line, near 0 for a surface that the line grazes.
struct Cut {
  double low_m = 0.0;
  double high_m = 0.0;
  double low_slope = 1.0;
  double high_slope = 1.0;
};

/// The displacements of a convex tool geom that make it overlap a convex target geom: the Minkowski difference, convex
/// itself, so that any line meets it in one interval.
class ConvexObstacle {
 public:
  ConvexObstacle(ConvexShape tool, ConvexShape target);

  /// The interval in which the line through `point_m` along coordinate axis `axis` lies in the obstacle, in that
  /// coordinate; empty when it misses. Exact to 1e-9 m for polytopes; for curved shapes to 1e-8 m.
  ///
  /// The line's highest point t in the obstacle is the maximum of a linear program over the points of the obstacle; it
  /// is solved by column generation: a triangle of support points whose projection holds the line, replaced until no
  /// support point lies beyond its plane (the scheme of Minkowski portal refinement, Snethen 2008).
  std::optional<Cut> CutBy(int axis, const Eigen::Vector3d& point_m) const;

  const Eigen::Vector3d& min_m() const { return min_m_; }
  const Eigen::Vector3d& max_m() const { return max_m_; }

 private:
  Eigen::Vector3d Support(const Eigen::Vector3d& direction) const {
    return target_.Support(direction) - tool_.Support(-direction);
  }

  ConvexShape tool_;
  ConvexShape target_;
  Eigen::Vector3d center_m_;
  Eigen::Vector3d min_m_;
  Eigen::Vector3d max_m_;
  bool is_aligned_box_;
};

}  // namespace feeler::planner
