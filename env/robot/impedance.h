#pragma once

#include <Eigen/Core>

#include "feeler/env/robot/tool_kinematics.h"
#include "feeler/env/robot/trajectory.h"
#include "feeler/env/scene/world.h"

namespace feeler::env {

/// The spring and damper that hold the tool, in tool axes.
struct ImpedanceGains {
  Eigen::Vector3d stiffness_n_m{1000, 1000, 4000};
  double rotational_stiffness_nm_rad = 200.0;
  double damping_ratio = 1.0;
};

/// Cartesian impedance without inertia shaping (Hogan 1985): J^T (K error + D velocity error) + M J^-1 reference
/// acceleration + bias. D is the critical damping of each tool axis on its own, from the inertia the arm shows along it
/// at present. `frame`: ToolKinematics of the measured joints.
JointVector CartesianImpedance(const World& world, const ToolFrame& frame, const JointVector& qd_rad_s,
                               const PosePoint& reference, const ImpedanceGains& gains);

}  // namespace feeler::env
