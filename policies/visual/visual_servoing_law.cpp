#include "feeler/policies/visual/visual_servoing_law.h"

#include <Eigen/SVD>

namespace feeler::policies {

Eigen::Matrix<double, 2, 6> PointInteraction(const ImagePoint& point, double depth_m) {
  const double x = point.x();
  const double y = point.y();
  const double z = depth_m;
  Eigen::Matrix<double, 2, 6> interaction;
  interaction << -1.0 / z, 0.0, x / z, x * y, -(1.0 + x * x), y,  //
      0.0, -1.0 / z, y / z, 1.0 + y * y, -x * y, -x;
  return interaction;
}

CameraTwist ServoStep(const std::vector<ServoPoint>& points, ServoFreedom freedom) {
  const int columns = freedom == ServoFreedom::kTranslation ? 3 : 6;
  const auto rows = 2 * static_cast<Eigen::Index>(points.size());
  CameraTwist step = CameraTwist::Zero();
  if (rows <= columns) return step;
  Eigen::MatrixXd interaction(rows, columns);
  Eigen::VectorXd error(rows);
  for (Eigen::Index i = 0; i < rows / 2; ++i) {
    const ServoPoint& point = points[static_cast<std::size_t>(i)];
    interaction.middleRows<2>(2 * i) = PointInteraction(point.seen, point.depth_m).leftCols(columns);
    error.segment<2>(2 * i) = point.seen - point.goal;
  }
  Eigen::JacobiSVD<Eigen::MatrixXd> inverse(interaction, Eigen::ComputeThinU | Eigen::ComputeThinV);
  constexpr double kDegenerate = 1e-4;  // of the largest singular value
  inverse.setThreshold(kDegenerate);
  if (inverse.rank() < columns) return step;
  step.head(columns) = -inverse.solve(error);
  return step;
}

}  // namespace feeler::policies
