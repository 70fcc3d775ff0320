#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/perception/icp_fit.h"
#include "feeler/perception/registration.h"

namespace feeler::perception {

/// How far a camera saw, by direction: cells of equal angle around the middle of what is looked at.
class SightGrid {
 public:
  /// `measured`: all that the camera at `eye_m` measured (world), background too. Cells are `spacing_m` wide where
  /// `middle_m` lies. What is more than kWidest off the direction to there is left out.
  SightGrid(const Points& measured, const Eigen::Vector3d& eye_m, const Eigen::Vector3d& middle_m, double spacing_m);

  /// The shortest range measured in the direction of `point_m` (world), or in the cells around; empty where nothing was
  /// measured in its own cell.
  std::optional<double> Range_m(const Eigen::Vector3d& point_m) const;

  static constexpr double kWidest = 1.0;  ///< tangent of the angle

 private:
  std::optional<std::pair<int, int>> CellOf(const Eigen::Vector3d& ray) const;

  Eigen::Vector3d eye_m_;
  Eigen::Vector3d ahead_, right_, down_;
  double cell_;  ///< tangent
  int side_;     ///< cells from the middle to either end
  std::vector<float> range_m_;
};

/// Sets what speaks against a pose, of a match that is otherwise judged. `fit`: of the model's fine level. `sight`: in
/// the world.
void Contradict(const IcpFit& fit, const TargetModel& model, const SightGrid& sight, const Pose& world_T_target,
                MatchEvidence& evidence);

}  // namespace feeler::perception
