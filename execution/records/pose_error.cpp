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
  return {across.norm(), across.cwiseAbs().maxCoeff(), std::abs(difference.translation()[along]),
          InsertionAngle(task, difference.linear())};
}

bool WithinTolerance(const Tolerance& tolerance, const PoseError& error) {
  return error.largest_lateral_m <= tolerance.lateral_m && error.vertical_m <= tolerance.vertical_m &&
         error.angle_rad <= tolerance.angle_rad;
}

}  // namespace feeler::execution
