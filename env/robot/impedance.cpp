#include "feeler/env/robot/impedance.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace feeler::env {
namespace {

// The diagonal of J M^-1 J^T: its inverse is the inertia felt along one axis while the others are free. With M = L L^T
// it is the squared norms of the columns of L^-1 J^T. Written out, because this runs in every control step and Eigen's
// solver is made for large matrices.
Vector6 Mobility(const Matrix6& inertia, const Matrix6& jacobian) {
  const Eigen::LLT<Matrix6> factor(inertia);
  const Matrix6& lower = factor.matrixLLT();
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> half = jacobian.transpose();
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < i; ++k) half.row(i) -= lower(i, k) * half.row(k);
    half.row(i) /= lower(i, i);
  }
  return half.colwise().squaredNorm();
}

}  // namespace

JointVector CartesianImpedance(const World& world, const ToolFrame& frame, const JointVector& qd_rad_s,
                               const PosePoint& reference, const ImpedanceGains& gains) {
  const Pose& tool = frame.pose;
  const Matrix6& jacobian = frame.jacobian;
  const Eigen::Matrix3d to_tool = tool.linear().transpose();

  Matrix6 tool_jacobian;  // the same, in tool axes
  tool_jacobian.topRows<3>() = to_tool * jacobian.topRows<3>();
  tool_jacobian.bottomRows<3>() = to_tool * jacobian.bottomRows<3>();
  const Vector6 mobility = Mobility(world.Inertia(), tool_jacobian);

  const Vector6 error = PoseError(tool, reference.pose);
  const Vector6 twist_error = reference.twist - jacobian * qd_rad_s;
  Vector6 local_error, local_twist, stiffness;
  local_error << to_tool * error.head<3>(), to_tool * error.tail<3>();
  local_twist << to_tool * twist_error.head<3>(), to_tool * twist_error.tail<3>();
  stiffness << gains.stiffness_n_m, Eigen::Vector3d::Constant(gains.rotational_stiffness_nm_rad);

  Vector6 wrench;
  for (int i = 0; i < 6; ++i) {
    const double damping = 2 * gains.damping_ratio * std::sqrt(stiffness[i] / std::max(mobility[i], 1e-6));
    wrench[i] = stiffness[i] * local_error[i] + damping * local_twist[i];
  }
  // Without the inertia the coupling between the axes throws the tool sideways whenever the reference speeds up or
  // stops.
  JointVector torque_nm = tool_jacobian.transpose() * wrench + world.BiasTorque();
  if (!reference.acceleration.isZero(0.0)) {
    torque_nm += world.InertiaTimes(jacobian.partialPivLu().solve(reference.acceleration));
  }
  return torque_nm;
}

}  // namespace feeler::env
