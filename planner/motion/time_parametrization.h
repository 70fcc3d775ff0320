#pragma once

#include <Eigen/Core>
#include <vector>

namespace feeler::planner {

struct MotionLimits {
  Eigen::VectorXd velocity_rad_s;       ///< per joint, > 0
  Eigen::VectorXd acceleration_rad_s2;  ///< per joint, > 0
};

struct TimeParametrizationOptions {
  /// How far the motion may cut a corner, as a sweep: sum over joints of reach_m * |deviation| (metres where reach_m is
  /// in metres per radian). Zero: it stops at every way point.
  double corner_deviation_m = 0.002;
  Eigen::VectorXd reach_m;      ///< as in TransferOptions; empty: ones
  int stages_per_segment = 40;  ///< grid of the time scaling, per straight piece or corner
};

struct JointState {
  Eigen::VectorXd q_rad;
  Eigen::VectorXd qd_rad_s;
  Eigen::VectorXd qdd_rad_s2;
};

/// A motion from rest to rest along way points. Between corners it runs straight in joint space; corners are rounded by
/// parabolas. Immutable; safe to sample from many threads.
///
/// Laws: Sample(0).q = first way point, Sample(duration).q = last, both at rest; qd and qdd are the derivatives of q
/// (qdd jumps, q and qd do not); |qd| and |qdd| stay within the limits at all times; the deviation from the polyline
/// stays within corner_deviation_m.
class JointTrajectory {
 public:
  double duration_s() const { return times_s_.empty() ? 0.0 : times_s_.back(); }
  /// State at time t, clamped to [0, duration].
  JointState Sample(double time_s) const;

 private:
  friend JointTrajectory Parametrize(const std::vector<Eigen::VectorXd>& way_points_rad, const MotionLimits& limits,
                                     const TimeParametrizationOptions& options);

  // Piece k of the path: q(s) = start + s * tangent + s^2 / 2 * curvature, 0 <= s <= length.
  struct Piece {
    Eigen::VectorXd start;
    Eigen::VectorXd tangent;
    Eigen::VectorXd curvature;
    double length = 0.0;
  };
  // Stage i of the time scaling lies on one piece: s(t) = s + v (t - t_i) + a / 2 (t - t_i)^2.
  struct Stage {
    std::size_t piece = 0;
    double s = 0.0;
    double speed = 0.0;
    double acceleration = 0.0;
  };

  static std::vector<Piece> RoundCorners(const std::vector<Eigen::VectorXd>& way_points,
                                         const TimeParametrizationOptions& options);
  void ScaleTime(const MotionLimits& limits, int stages_per_segment);

  std::vector<Piece> pieces_;
  std::vector<Stage> stages_;
  std::vector<double> times_s_;  ///< start of stage i; one more entry: the end
  Eigen::VectorXd rest_;         ///< where there is no way to go
};

/// The time-optimal scaling, under the limits, of the rounded path (reachability analysis over a grid: Pham and Pham
/// 2018, "A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis").
/// `way_points_rad`: at least one; repeated ones are dropped.
/// Throws InputError when sizes do not agree or a limit is not positive.
JointTrajectory Parametrize(const std::vector<Eigen::VectorXd>& way_points_rad, const MotionLimits& limits,
                            const TimeParametrizationOptions& options = {});

}  // namespace feeler::planner
