#include "feeler/execution/records/pose_error.h"

#include <cmath>

#include "feeler/core/direction.h"

namespace feeler::execution {

double AngleBetween(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}

PoseError PoseErrorOf(const Task& task, const Pose& reference, const Pose& pose) {
  const Pose difference = reference.inverse() * pose;
  const int along = AxisOf(task.insertion);
  Eigen::Vector3d across = difference.translation();
  across[along] = 0.0;
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(difference.linear()));
  Eigen::Vector3d turn_rad = turn.angle() * turn.axis();
  if (task.turns_freely) turn_rad[along] = 0.0;
  return {across.norm(),
          across.cwiseAbs().maxCoeff(),
          std::abs(difference.translation()[along]),
          InsertionAngle(task, difference.linear()),
          across,
          turn_rad};
}

bool WithinTolerance(const Tolerance& tolerance, const PoseError& error) {
  // Negated, so that what is not a number is not within.
  if (!(error.vertical_m <= tolerance.vertical_m)) return false;
  if (tolerance.one_angle() && !(error.angle_rad <= tolerance.angle_rad)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(std::abs(error.across_m[axis]) <= tolerance.Lateral(axis))) return false;
    if (!tolerance.one_angle() && !(std::abs(error.turn_rad[axis]) <= tolerance.Angle(axis))) return false;
  }
  return true;
}

}  // namespace feeler::execution
