#include "feeler/execution/pose/pose_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace feeler::execution {
namespace {

/// Steps of the numerical derivative: 0.05 mm, and the turn that moves a lever of 100 mm by as much.
constexpr double kStep_m = 5e-5;
constexpr double kStep_rad = 5e-4;
/// Fits nearer to each other than this, per axis, are one.
constexpr double kSame_m = 1e-4;
constexpr double kSame_rad = 1e-3;

double StepOf(int axis) { return axis < 3 ? kStep_m : kStep_rad; }

class Fitter {
 public:
  Fitter(planner::TravelModel& model, const std::vector<FeltMotion>& felt, const PoseBox& box,
         const PoseFitOptions& options)
      : model_(model), felt_(felt), box_(box), options_(options) {
    for (int axis = 0; axis < 5; ++axis) {
      if (box.upper[axis] > box.lower[axis]) free_.push_back(axis);
    }
  }

  PoseFit Fit(const PoseVector& start) {
    pose_ = box_.Clamp(start);
    Descend(options_.coarse_scale_m, options_.coarse_iterations);
    Descend(options_.fine_scale_m, options_.fine_iterations);
    PoseFit fit;
    fit.pose = pose_;
    const Eigen::VectorXd residuals = Residuals(pose_);
    fit.cost = Cost(residuals, options_.fine_scale_m);
    fit.worst_m = residuals.size() > 0 ? residuals.cwiseAbs().maxCoeff() : 0.0;
    const Eigen::MatrixXd information = Normal(residuals, options_.fine_scale_m).first;
    Eigen::MatrixXd with_prior = information;
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const double width = box_.upper[free_[k]] - box_.lower[free_[k]];
      with_prior(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)) += 12.0 / (width * width);
    }
    const Eigen::MatrixXd covariance = with_prior.ldlt().solve(
        Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(free_.size()), static_cast<Eigen::Index>(free_.size())));
    for (std::size_t a = 0; a < free_.size(); ++a) {
      for (std::size_t b = 0; b < free_.size(); ++b) {
        fit.covariance(free_[a], free_[b]) = covariance(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
      }
    }
    return fit;
  }

 private:
  Eigen::VectorXd Residuals(const PoseVector& pose) {
    const std::vector<double> residuals = PoseResiduals(model_, felt_, pose, options_.cap_m);
    return Eigen::Map<const Eigen::VectorXd>(residuals.data(), static_cast<Eigen::Index>(residuals.size()));
  }

  /// Scales of motions read less well are wider by as much.
  double ScaleOf(std::size_t i, double scale_m) const { return scale_m * std::max(1.0, felt_[i].sigma_m / 1e-4); }

  double Cost(const Eigen::VectorXd& residuals, double scale_m) const {
    double cost = 0.0;
    for (std::size_t i = 0; i < felt_.size(); ++i) {
      const double scale = ScaleOf(i, scale_m);
      const double ratio = residuals[static_cast<Eigen::Index>(i)] / scale;
      cost += scale * scale * std::log1p(ratio * ratio) / (felt_[i].sigma_m * felt_[i].sigma_m);
    }
    return cost;
  }

  /// Matrix and right-hand side of the normal equations, weighted.
  std::pair<Eigen::MatrixXd, Eigen::VectorXd> Normal(const Eigen::VectorXd& residuals, double scale_m) {
    const auto unknowns = static_cast<Eigen::Index>(free_.size());
    Eigen::MatrixXd jacobian(residuals.size(), unknowns);
    for (Eigen::Index k = 0; k < unknowns; ++k) {
      const int axis = free_[static_cast<std::size_t>(k)];
      PoseVector moved = pose_;
      moved[axis] += StepOf(axis);
      const Eigen::VectorXd ahead = Residuals(moved);
      moved[axis] = pose_[axis] - StepOf(axis);
      jacobian.col(k) = (ahead - Residuals(moved)) / (2.0 * StepOf(axis));
    }
    Eigen::VectorXd weights(residuals.size());
    for (std::size_t i = 0; i < felt_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double ratio = residuals[row] / ScaleOf(i, scale_m);
      weights[row] = 1.0 / ((1.0 + ratio * ratio) * felt_[i].sigma_m * felt_[i].sigma_m);
      // An edge that is crossed within the step of the derivative is no slope.
      for (Eigen::Index k = 0; k < unknowns; ++k) {
        const double steepest = free_[static_cast<std::size_t>(k)] < 3 ? 8.0 : 1.0;
        if (std::abs(jacobian(row, k)) > steepest) jacobian(row, k) = 0.0;
      }
    }
    const Eigen::MatrixXd weighted = weights.asDiagonal() * jacobian;
    return {jacobian.transpose() * weighted, weighted.transpose() * residuals};
  }

  void Descend(double scale_m, int iterations) {
    if (free_.empty()) return;
    double damping = 1e-2;
    Eigen::VectorXd residuals = Residuals(pose_);
    double cost = Cost(residuals, scale_m);
    for (int iteration = 0; iteration < iterations; ++iteration) {
      const auto [matrix, right] = Normal(residuals, scale_m);
      bool better = false;
      for (int attempt = 0; attempt < 4 && !better; ++attempt) {
        Eigen::MatrixXd damped = matrix;
        for (std::size_t k = 0; k < free_.size(); ++k) {
          const auto i = static_cast<Eigen::Index>(k);
          const double least = free_[k] < 3 ? 1e4 : 1e2;  // a direction that nothing tells of stays where it is
          damped(i, i) += damping * (matrix(i, i) + least);
        }
        const Eigen::VectorXd step = damped.ldlt().solve(-right);
        PoseVector trial = pose_;
        for (std::size_t k = 0; k < free_.size(); ++k) {
          const double longest = free_[k] < 3 ? 4e-3 : 0.06;
          trial[free_[k]] += std::clamp(step[static_cast<Eigen::Index>(k)], -longest, longest);
        }
        trial = box_.Clamp(trial);
        const Eigen::VectorXd trial_residuals = Residuals(trial);
        const double trial_cost = Cost(trial_residuals, scale_m);
        if (trial_cost < cost) {
          better = cost - trial_cost > 1e-6 * cost;
          pose_ = trial;
          residuals = trial_residuals;
          cost = trial_cost;
          damping = std::max(1e-6, damping * 0.2);
          if (!better) return;
        } else {
          damping *= 8.0;
        }
      }
      if (!better) return;
    }
  }

  planner::TravelModel& model_;
  const std::vector<FeltMotion>& felt_;
  const PoseBox& box_;
  const PoseFitOptions& options_;
  std::vector<int> free_;
  PoseVector pose_ = PoseVector::Zero();
};

bool Same(const PoseVector& a, const PoseVector& b) {
  const PoseVector difference = (a - b).cwiseAbs();
  return difference.head<3>().maxCoeff() < kSame_m && difference.tail<2>().maxCoeff() < kSame_rad;
}

}  // namespace

Pose ToPose(const PoseVector& pose) {
  Pose result = Pose::Identity();
  result.linear() =
      (Eigen::AngleAxisd(pose[3], Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pose[4], Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  result.translation() = pose.head<3>();
  return result;
}

std::vector<double> PoseResiduals(planner::TravelModel& model, const std::vector<FeltMotion>& felt,
                                  const PoseVector& pose, double cap_m) {
  std::vector<planner::ToolMotion> motions;
  motions.reserve(felt.size());
  for (const FeltMotion& motion : felt) motions.push_back(motion.motion);
  std::vector<double> residuals = model.Travel(ToPose(pose), motions);
  for (std::size_t i = 0; i < felt.size(); ++i) {
    const double difference = residuals[i] - felt[i].travelled_m;
    residuals[i] = std::clamp(felt[i].contact ? difference : std::min(0.0, difference), -cap_m, cap_m);
  }
  return residuals;
}

std::vector<PoseFit> FitPose(planner::TravelModel& model, const std::vector<FeltMotion>& felt, const PoseBox& box,
                             const std::vector<PoseVector>& starts, const PoseFitOptions& options) {
  std::vector<PoseFit> fits;
  Fitter fitter(model, felt, box, options);
  for (const PoseVector& start : starts) fits.push_back(fitter.Fit(start));
  std::stable_sort(fits.begin(), fits.end(), [](const PoseFit& a, const PoseFit& b) { return a.cost < b.cost; });
  std::vector<PoseFit> distinct;
  for (const PoseFit& fit : fits) {
    const bool known =
        std::any_of(distinct.begin(), distinct.end(), [&](const PoseFit& other) { return Same(fit.pose, other.pose); });
    if (!known) distinct.push_back(fit);
  }
  return distinct;
}

}  // namespace feeler::execution
