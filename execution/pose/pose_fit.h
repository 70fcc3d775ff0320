#pragma once

#include <Eigen/Core>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/task.h"
#include "feeler/planner/contact/travel_model.h"

namespace feeler::execution {

/// Pose of a target relative to a lattice frame: x, y, z (m), yaw, pitch (rad); Rz(yaw) Ry(pitch).
using PoseVector = Eigen::Matrix<double, 5, 1>;
using PoseMatrix = Eigen::Matrix<double, 5, 5>;

Pose ToPose(const PoseVector& pose);

/// A motion that was felt, and how it ended.
struct FeltMotion {
  planner::ToolMotion motion;
  double travelled_m = 0.0;
  bool contact = false;   ///< it ended at a contact; without: all of it was free
  double sigma_m = 1e-4;  ///< how well the end is known
};

/// Poses that a target may have. An axis with equal bounds is certain.
struct PoseBox {
  PoseVector lower = PoseVector::Zero();
  PoseVector upper = PoseVector::Zero();
  PoseVector Clamp(const PoseVector& pose) const { return pose.cwiseMax(lower).cwiseMin(upper); }
};

struct PoseFitOptions {
  int coarse_iterations = 8;  ///< in which residuals of millimetres pull with all their weight
  int fine_iterations = 8;    ///< in which they are taken for false readings
  double coarse_scale_m = 3e-3;
  double fine_scale_m = 4e-4;
  double cap_m = 6e-3;  ///< of a residual: a contact where nothing would be met
};

struct PoseFit {
  PoseVector pose = PoseVector::Zero();
  double cost = 0.0;                           ///< robust sum of squares, in units of sigma
  double worst_m = 0.0;                        ///< largest residual of a motion
  PoseMatrix covariance = PoseMatrix::Zero();  ///< from the contacts and the box; zero along certain axes
};

/// Residuals of the motions at a pose, metres: travel predicted less travelled for a contact, depth in the target
/// (negative) for a free motion.
std::vector<double> PoseResiduals(planner::TravelModel& model, const std::vector<FeltMotion>& felt,
                                  const PoseVector& pose, double cap_m);

/// Levenberg-Marquardt from each of the starts on all motions, with robust weights (Cauchy), within the box. Sorted by
/// cost; those that come to the same pose once. Deterministic.
std::vector<PoseFit> FitPose(planner::TravelModel& model, const std::vector<FeltMotion>& felt, const PoseBox& box,
                             const std::vector<PoseVector>& starts, const PoseFitOptions& options = {});

}  // namespace feeler::execution
