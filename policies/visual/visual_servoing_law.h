#pragma once

#include <Eigen/Core>
#include <vector>

namespace feeler::policies {

/// Linear (m/s) and angular (rad/s) velocity of the camera in its own axes: x right, y down, z forward.
using CameraTwist = Eigen::Matrix<double, 6, 1>;

/// A point that is seen: normalised image coordinates (x / z, y / z).
using ImagePoint = Eigen::Vector2d;

/// A point as it is seen and as it is to be seen.
struct ServoPoint {
  ImagePoint seen = ImagePoint::Zero();
  ImagePoint goal = ImagePoint::Zero();
  double depth_m = 0.0;  ///< along the optical axis, from the camera; need not be exact
};

/// How the image of a resting point moves with the camera: d(x, y)/dt = L (v, w).
/// Chaumette and Hutchinson, Visual servo control I, IEEE Robotics & Automation Magazine 13(4), 2006, equation 11.
Eigen::Matrix<double, 2, 6> PointInteraction(const ImagePoint& point, double depth_m);

/// Which part of the camera's velocity is used.
enum class ServoFreedom {
  kTranslation,  ///< the orientation is known and kept
  kAll,
};

/// The displacement -L^+ e that a first-order model expects to bring the points to their goals (m and rad; as a twist
/// it would take one second). Zero where the points do not determine it (fewer than two, or three for kAll).
CameraTwist ServoStep(const std::vector<ServoPoint>& points, ServoFreedom freedom);

}  // namespace feeler::policies
