#pragma once

#include <mujoco/mujoco.h>

#include <memory>

#include "feeler/env/arm/ur10e.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {

/// How the physics of an episode differs from that of the scene.
struct PhysicsVariation {
  JointVector joint_friction_nm = JointVector::Zero();  ///< Coulomb friction of each joint, on top of the scene's
  double contact_friction = 1.0;                        ///< factor on the sliding friction of every contact
  double tool_mass = 1.0;                               ///< factor on mass and inertia of the tool
  double clearance_m = 0.0;                             ///< added on each side of the tool across the insertion axis
  /// How the tool has slipped in the gripper, which the robot does not know: shifted in its own axes, and turned about
  /// the insertion axis.
  Eigen::Vector3d tool_slip_m = Eigen::Vector3d::Zero();
  double tool_turn_rad = 0.0;
  /// The target gives way: it stands on springs of this stiffness (N/m) along every axis, by up to kPortTravel_m, and
  /// stays where friction of kPortFriction_n holds it. 0: it stands fast.
  double port_stiffness_n_m = 0.0;
  static constexpr double kPortTravel_m = 1e-3;
  static constexpr double kPortFriction_n = 2.0;
  double worn_m = 0.0;  ///< the lead-in of the target is larger by this (worn_edges.h); negative: smaller
  bool operator==(const PhysicsVariation&) const = default;
  /// Throws InputError naming the number that makes no sense.
  void Validate() const;
};

/// A copy of the scene's model (40 kB) with the variation; the scene's own where there is none. Sizes are the same, so
/// one mjData serves both. Throws InputError where a number makes no sense, or where the tool cannot be made narrower
/// along its axes (an ellipsoid, a slanted box, a mesh that others use as well).
std::shared_ptr<const mjModel> VariedModel(const Scene& scene, const PhysicsVariation& variation);

}  // namespace feeler::env
