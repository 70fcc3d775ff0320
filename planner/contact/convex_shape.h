#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/planner/contact/support_table.h"

namespace feeler::planner {

enum class ShapeKind : std::uint8_t { kBox, kSphere, kCapsule, kCylinder, kEllipsoid, kPolytope };

/// A convex part of a body, as data: what a task's geoms come to, without a simulator.
struct ConvexPiece {
  ShapeKind kind = ShapeKind::kBox;
  /// Metres. Box, ellipsoid: half axes; sphere: radius; capsule, cylinder: radius and half length (along z). Unused by
  /// a polytope.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  Pose frame_T_piece = Pose::Identity();
  std::vector<Eigen::Vector3d> vertices_m;  ///< of a polytope, in its own frame
};

/// A convex piece, placed in a frame and known by its support points (metres).
class ConvexShape {
 public:
  explicit ConvexShape(const ConvexPiece& piece);

  /// Makes Support fast for a shape that will be asked very often, where it has many corners. Same answers.
  void PrepareForMany();
  /// The point of the shape farthest along `direction` (need not be a unit vector, must not be zero).
  Eigen::Vector3d Support(const Eigen::Vector3d& direction) const;
  /// A point inside.
  Eigen::Vector3d center() const { return pose_.translation(); }
  /// A box whose edges are parallel to the axes of the frame.
  bool is_aligned_box() const { return is_aligned_box_; }

 private:
  Eigen::Vector3d LocalSupport(const Eigen::Vector3d& direction) const;

  ShapeKind kind_;
  Eigen::Vector3d size_m_;
  Pose pose_;
  std::vector<Eigen::Vector3d> hull_m_;        ///< of a polytope, in the frame
  std::shared_ptr<const SupportTable> table_;  ///< of them, once it was made; copies share it
  bool is_aligned_box_ = false;
};

}  // namespace feeler::planner
