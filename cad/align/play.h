#pragma once

#include <Eigen/Core>
#include <numbers>

#include "feeler/cad/measure/sliding.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/mesh/triangle_mesh.h"
#include "feeler/core/pose.h"

namespace feeler::cad {

inline constexpr double kDegree = std::numbers::pi / 180;
/// Play of more than this share of what goes in is no fit.
inline constexpr double kMostSlack = 0.35;

/// The turn about z by an angle, exact for quarters.
Eigen::Matrix3d Roll(double angle);
Pose FrameOf(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& offset);

/// Puts the tool into the middle of its play across; false when it has too much or none.
bool Center(const MeshSlide& slide, double most_m, Eigen::Vector3d& offset, double& slack_m);

/// Turns a tool that is in to the middle of its play about z, as far as it has less than a few degrees: it is moved by
/// `offset`, which moves with it, after it was turned by `roll_rad`, about `middle`.
void CenterRoll(const TriangleMesh& tool, const MeshTree& target, const Eigen::Vector2d& middle,
                Eigen::Vector3d& offset, double& roll_rad);

}  // namespace feeler::cad
