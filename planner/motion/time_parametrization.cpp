#include "feeler/planner/motion/time_parametrization.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "feeler/core/error.h"

namespace feeler::planner {
namespace {

constexpr double kSameWayPoint_rad = 1e-12;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Limits on path acceleration u given squared path speed x, of one stage: lower(x) <= u <= upper(x). Every joint gives
// |tangent u + curvature x| <= limit, at the begin of the stage and at its end (where x has become x + 2 ds u).
class StageLimits {
 public:
  void Add(const Eigen::VectorXd& tangent, const Eigen::VectorXd& curvature, const Eigen::VectorXd& limit) {
    for (Eigen::Index i = 0; i < limit.size(); ++i) rows_.push_back({tangent[i], curvature[i], limit[i]});
  }
  double Upper(double x) const { return Bound(x, 1.0); }
  double Lower(double x) const { return -Bound(x, -1.0); }

 private:
  struct Row {
    double tangent;
    double curvature;
    double limit;
  };
  // The largest u (sign = 1) or the largest -u (sign = -1).
  double Bound(double x, double sign) const {
    double bound = kInfinity;
    for (const Row& row : rows_) {
      const double gain = sign * row.tangent;
      if (gain > 0.0) {
        bound = std::min(bound, (row.limit - row.curvature * x) / gain);
      } else if (gain < 0.0) {
        bound = std::min(bound, (row.limit + row.curvature * x) / -gain);
      } else if (std::abs(row.curvature) * x > row.limit) {
        return -kInfinity;
      }
    }
    return bound;
  }
  std::vector<Row> rows_;
};

void Check(const std::vector<Eigen::VectorXd>& way_points, const MotionLimits& limits,
           const TimeParametrizationOptions& options) {
  const auto require = [](bool good, const char* what, const char* mend) {
    if (!good) throw InputError("time parametrization", what, mend);
  };
  require(!way_points.empty(), "no way points", "give at least one");
  const Eigen::Index joints = way_points.front().size();
  for (const Eigen::VectorXd& q : way_points) {
    require(q.size() == joints && q.allFinite(), "way points of different sizes", "one finite angle per joint");
  }
  require(limits.velocity_rad_s.size() == joints && limits.acceleration_rad_s2.size() == joints &&
              (limits.velocity_rad_s.array() > 0.0).all() && (limits.acceleration_rad_s2.array() > 0.0).all(),
          "limits out of range", "one positive velocity and acceleration per joint");
  require(options.corner_deviation_m >= 0.0 && options.stages_per_segment >= 2, "options out of range",
          "corner_deviation_m >= 0, stages_per_segment >= 2");
  require(options.reach_m.size() == 0 || options.reach_m.size() == joints, "reach_m of another size",
          "one reach per joint, or none");
}

}  // namespace

std::vector<JointTrajectory::Piece> JointTrajectory::RoundCorners(const std::vector<Eigen::VectorXd>& way_points,
                                                                  const TimeParametrizationOptions& options) {
  const std::size_t segments = way_points.size() - 1;
  std::vector<Eigen::VectorXd> direction(segments);
  std::vector<double> length(segments);
  for (std::size_t i = 0; i < segments; ++i) {
    length[i] = (way_points[i + 1] - way_points[i]).norm();
    direction[i] = (way_points[i + 1] - way_points[i]) / length[i];
  }
  // Each corner is cut by the same distance `cut` on both sides; the parabola leaves the corner by cut / 4 * |turn|.
  std::vector<double> cut(segments + 1, 0.0);
  for (std::size_t i = 1; i < segments; ++i) {
    const Eigen::VectorXd turn = (direction[i] - direction[i - 1]).cwiseAbs();
    const double deviation = options.reach_m.size() == 0 ? turn.sum() : options.reach_m.dot(turn);
    const double room = 0.49 * std::min(length[i - 1], length[i]);
    cut[i] = deviation * room <= 4.0 * options.corner_deviation_m ? room : 4.0 * options.corner_deviation_m / deviation;
  }
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < segments; ++i) {
    Piece straight;
    straight.start = way_points[i] + cut[i] * direction[i];
    straight.tangent = direction[i];
    straight.curvature = Eigen::VectorXd::Zero(direction[i].size());
    straight.length = length[i] - cut[i] - cut[i + 1];
    pieces.push_back(straight);
    if (i + 1 == segments || cut[i + 1] == 0.0) continue;
    Piece corner;
    corner.start = way_points[i + 1] - cut[i + 1] * direction[i];
    corner.tangent = direction[i];
    corner.length = 2.0 * cut[i + 1];
    corner.curvature = (direction[i + 1] - direction[i]) / corner.length;
    pieces.push_back(corner);
  }
  return pieces;
}

void JointTrajectory::ScaleTime(const MotionLimits& limits, int stages_per_segment) {
  // The grid: every piece in equal stages.
  std::vector<StageLimits> stage_limits;
  std::vector<double> steps;
  std::vector<double> cap;  // squared path speed at grid points that the joint velocities allow
  const auto speed_cap = [&](const Eigen::VectorXd& derivative) {
    double bound = kInfinity;
    for (Eigen::Index i = 0; i < derivative.size(); ++i) {
      if (derivative[i] != 0.0) bound = std::min(bound, std::abs(limits.velocity_rad_s[i] / derivative[i]));
    }
    return bound * bound;
  };
  cap.push_back(0.0);  // starts at rest
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    const Piece& piece = pieces_[p];
    const double step = piece.length / stages_per_segment;
    // Without a rounded corner the direction jumps: come to rest there.
    const bool jump =
        p > 0 &&
        (pieces_[p - 1].tangent + pieces_[p - 1].length * pieces_[p - 1].curvature - piece.tangent).norm() > 1e-9;
    cap.back() = jump ? 0.0 : std::min(cap.back(), speed_cap(piece.tangent));
    for (int k = 0; k < stages_per_segment; ++k) {
      const Eigen::VectorXd begin = piece.tangent + k * step * piece.curvature;
      const Eigen::VectorXd end = begin + step * piece.curvature;
      StageLimits bounds;
      bounds.Add(begin, piece.curvature, limits.acceleration_rad_s2);
      bounds.Add(end + 2.0 * step * piece.curvature, piece.curvature, limits.acceleration_rad_s2);
      stage_limits.push_back(std::move(bounds));
      steps.push_back(step);
      cap.push_back(speed_cap(end));
      stages_.push_back({p, k * step, 0.0, 0.0});
    }
  }
  cap.back() = 0.0;  // ends at rest
  const std::size_t stages = stages_.size();

  // Backward: the largest squared speed at each grid point from which the rest of the path can be driven. The set of
  // such speeds is an interval from zero, found by bisection of a concave function.
  std::vector<double> reachable(stages + 1, 0.0);
  for (std::size_t i = stages; i-- > 0;) {
    const auto feasible = [&](double x) {
      const double lower = std::max(stage_limits[i].Lower(x), -x / (2.0 * steps[i]));
      const double upper = std::min(stage_limits[i].Upper(x), (reachable[i + 1] - x) / (2.0 * steps[i]));
      return lower <= upper;
    };
    double low = 0.0;
    double high = std::min(cap[i], 1e12);
    if (feasible(high)) {
      low = high;
    } else {
      for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (low + high);
        (feasible(middle) ? low : high) = middle;
      }
    }
    reachable[i] = low;
  }
  // Forward: as fast as possible.
  double x = 0.0;
  double time_s = 0.0;
  times_s_.push_back(0.0);
  for (std::size_t i = 0; i < stages; ++i) {
    const double u = std::min(stage_limits[i].Upper(x), (reachable[i + 1] - x) / (2.0 * steps[i]));
    const double next = std::clamp(x + 2.0 * steps[i] * u, 0.0, reachable[i + 1]);
    const double speed = std::sqrt(x);
    const double next_speed = std::sqrt(next);
    assert(speed + next_speed > 0.0);
    const double duration = 2.0 * steps[i] / (speed + next_speed);
    stages_[i].speed = speed;
    stages_[i].acceleration = (next_speed - speed) / duration;
    time_s += duration;
    times_s_.push_back(time_s);
    x = next;
  }
}

JointState JointTrajectory::Sample(double time_s) const {
  JointState state;
  if (stages_.empty()) {
    state.q_rad = rest_;
    state.qd_rad_s = Eigen::VectorXd::Zero(rest_.size());
    state.qdd_rad_s2 = state.qd_rad_s;
    return state;
  }
  const double t = std::clamp(time_s, 0.0, times_s_.back());
  const auto after = std::upper_bound(times_s_.begin(), times_s_.end() - 1, t);
  const auto index = static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - times_s_.begin() - 1, 0));
  const Stage& stage = stages_[std::min(index, stages_.size() - 1)];
  const Piece& piece = pieces_[stage.piece];
  const double dt = t - times_s_[std::min(index, stages_.size() - 1)];
  const double s = std::min(stage.s + stage.speed * dt + 0.5 * stage.acceleration * dt * dt, piece.length);
  const double speed = std::max(stage.speed + stage.acceleration * dt, 0.0);
  const Eigen::VectorXd tangent = piece.tangent + s * piece.curvature;
  state.q_rad = piece.start + s * piece.tangent + 0.5 * s * s * piece.curvature;
  state.qd_rad_s = speed * tangent;
  state.qdd_rad_s2 = stage.acceleration * tangent + speed * speed * piece.curvature;
  return state;
}

JointTrajectory Parametrize(const std::vector<Eigen::VectorXd>& way_points_rad, const MotionLimits& limits,
                            const TimeParametrizationOptions& options) {
  Check(way_points_rad, limits, options);
  std::vector<Eigen::VectorXd> distinct;
  for (const Eigen::VectorXd& q : way_points_rad) {
    if (distinct.empty() || (q - distinct.back()).norm() > kSameWayPoint_rad) distinct.push_back(q);
  }
  JointTrajectory trajectory;
  trajectory.rest_ = distinct.back();
  if (distinct.size() < 2) return trajectory;
  trajectory.pieces_ = JointTrajectory::RoundCorners(distinct, options);
  trajectory.ScaleTime(limits, options.stages_per_segment);
  return trajectory;
}

}  // namespace feeler::planner
