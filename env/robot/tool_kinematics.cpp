#include "feeler/env/robot/tool_kinematics.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace feeler::env {

ToolFrame ToolKinematics(const Scene& scene, const JointVector& q_rad) {
  const KinematicChain chain = Chain(q_rad);
  ToolFrame tool;
  tool.pose = chain.base_T_flange * scene.flange_T_tool;
  tool.jacobian = JacobianAt(chain, tool.pose.translation());
  return tool;
}

Matrix6 ToolJacobian(const Scene& scene, const JointVector& q_rad) { return ToolKinematics(scene, q_rad).jacobian; }

Vector6 PoseError(const Pose& from, const Pose& to) {
  Vector6 error;
  const Eigen::Matrix3d turn = to.linear() * from.linear().transpose();
  // The skew part is sin(angle) * axis: exact in direction, and in size up to a cube for the small turns of control.
  Eigen::Vector3d rotation(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
  rotation *= 0.5;
  if (turn.trace() < 2.99) {  // beyond 0.1 rad
    const Eigen::AngleAxisd angle_axis(turn);
    rotation = angle_axis.angle() * angle_axis.axis();
  }
  error << to.translation() - from.translation(), rotation;
  return error;
}

bool SolveNearby(const Scene& scene, const Pose& world_T_tool, JointVector& q_rad, double max_change_rad) {
  constexpr int kMaxIterations = 20;
  constexpr double kTolerance = 1e-10;
  JointVector q = q_rad;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const ToolFrame tool = ToolKinematics(scene, q);
    const Vector6 error = PoseError(tool.pose, world_T_tool);
    if (error.cwiseAbs().maxCoeff() < kTolerance) {
      q_rad = q;
      return true;
    }
    q += tool.jacobian.partialPivLu().solve(error);
    if (!q.allFinite() || (q - q_rad).cwiseAbs().maxCoeff() > max_change_rad) return false;
    if (q.cwiseAbs().maxCoeff() > 2 * M_PI) return false;
  }
  return false;
}

}  // namespace feeler::env
