#include "feeler/execution/contact/contact_evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "feeler/execution/contact/continuous_travel.h"

namespace feeler::execution {
namespace {

/// The distance of the place of an oblique contact from the nearest wall that the motion can have met.
double ObliqueViolation(const planner::ContactMap& map, const Touch& touch, const Eigen::Vector3d& displacement,
                        int orientation) {
  constexpr double kAlong = 0.1;  // parts of the motion that can meet a wall
  constexpr double kBack = 1.0;   // cells; the wall is looked for from there
  double least = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(touch.oblique[axis]) < kAlong) continue;
    const Direction direction = MakeDirection(axis, touch.oblique[axis] < 0.0 ? -1 : 1);
    const Eigen::Vector3d end = displacement + touch.travelled * UnitVector(touch.direction);
    const double travel = ContinuousTravel(map, end - kBack * UnitVector(direction), direction, orientation);
    least = std::min(least, std::abs(travel - kBack));
  }
  return least;
}

double ViolationAt(const planner::ContactMap& map, const Touch& touch, const Eigen::Vector3d& displacement,
                   int orientation) {
  if (touch.is_oblique()) return ObliqueViolation(map, touch, displacement, orientation);
  const double travel = ContinuousTravel(map, displacement, touch.direction, orientation);
  return touch.contact ? std::abs(touch.travelled - travel) : std::max(0.0, touch.travelled - travel);
}

struct Score {
  int violations = std::numeric_limits<int>::max();
  double squares = 0.0;
  bool operator<(const Score& other) const {
    return violations != other.violations ? violations < other.violations : squares < other.squares - 1e-9;
  }
};

Score ScoreOf(const planner::ContactMap& map, const std::vector<Touch>& evidence, const Eigen::Vector3d& target,
              int orientation, const FitOptions& options, int give_up_above) {
  Score score{0, 0.0};
  for (const Touch& touch : evidence) {
    // Most touches are explained without the slack, which takes five times as long.
    double violation = ViolationAt(map, touch, touch.start - target, orientation);
    if (violation > options.violation_cells && options.slack_cells > 0.0) {
      violation = Violation(map, touch, target, orientation, options.slack_cells);
    }
    if (violation > options.violation_cells) {
      if (++score.violations > give_up_above) return {};
    } else if (touch.contact) {
      score.squares += violation * violation;
    }
  }
  return score;
}

/// Grid values of one axis: both ends and steps of at most `step` between them.
std::vector<double> GridValues(double lower, double upper, double step) {
  const int intervals = std::max(1, static_cast<int>(std::ceil((upper - lower) / step - 1e-9)));
  std::vector<double> values;
  for (int i = 0; i <= intervals; ++i) values.push_back(lower + (upper - lower) * i / intervals);
  return values;
}

/// How many of the four neighbouring lines miss the wall that is met from `displacement` (at most one to each side of
/// an axis); nothing for a slanted wall, which a neighbouring line meets at another travel: a bevel or a round side
/// tells about two axes at once and pins neither. Where lines miss, an edge is near, and an edge cut narrower than a
/// cell may have been met instead of the wall.
std::optional<int> EdgesNear(const planner::ContactMap& map, const Eigen::Vector3d& displacement, Direction direction,
                             int orientation) {
  constexpr double kSame = 0.2;
  constexpr double kMiss = 6.0;
  const double travel = ContinuousTravel(map, displacement, direction, orientation);
  int edges = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == AxisOf(direction)) continue;
    int same = 0;
    for (const int sign : {1, -1}) {
      Eigen::Vector3d line = displacement;
      line[axis] += sign;
      const double off = ContinuousTravel(map, line, direction, orientation) - travel;
      if (std::abs(off) <= kSame) {
        ++same;
      } else if (off < kMiss) {
        return std::nullopt;
      }
    }
    if (same == 0) return std::nullopt;
    if (same == 1) ++edges;
  }
  return edges;
}

/// Moves each axis onto the contacts that agree with `fit.position`, those alone that are farthest from edges; marks
/// the axes that have any.
void SnapToContacts(const planner::ContactMap& map, const std::vector<Touch>& evidence, int orientation,
                    const FitOptions& options, TargetFit& fit) {
  constexpr int kMostEdges = 2;
  std::array<std::array<double, kMostEdges + 1>, 3> sum{};
  std::array<std::array<int, kMostEdges + 1>, 3> count{};
  for (const Touch& touch : evidence) {
    if (!touch.contact || touch.is_oblique()) continue;
    const double travel = ContinuousTravel(map, touch.start - fit.position, touch.direction, orientation);
    const double residual = touch.travelled - travel;
    // The grid and its plateau centre add their own error to that of the reading.
    if (std::abs(residual) > options.violation_cells + options.step_cells) continue;
    const auto edges = EdgesNear(map, touch.start - fit.position, touch.direction, orientation);
    if (!edges) continue;
    const auto axis = static_cast<std::size_t>(AxisOf(touch.direction));
    sum[axis][static_cast<std::size_t>(*edges)] += SignOf(touch.direction) * residual;
    ++count[axis][static_cast<std::size_t>(*edges)];
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    fit.contacts[axis] = std::accumulate(count[axis].begin(), count[axis].end(), 0);
    fit.pinned[axis] = fit.contacts[axis] > 0;
    for (std::size_t edges = 0; edges <= kMostEdges; ++edges) {
      if (count[axis][edges] == 0) continue;
      fit.position[static_cast<Eigen::Index>(axis)] += sum[axis][edges] / count[axis][edges];
      break;
    }
  }
}

}  // namespace

Touch ContactAfter(const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  const Eigen::Vector3d motion = end - start;
  int axis = 0;
  const double along = motion.cwiseAbs().maxCoeff(&axis);
  Eigen::Vector3d across = motion;
  across[axis] = 0.0;
  Touch touch;
  touch.contact = true;
  touch.direction = MakeDirection(axis, motion[axis] < 0.0 ? -1 : 1);
  touch.travelled = along;
  touch.start = end - along * UnitVector(touch.direction);
  if (across.norm() > 0.1 * along) touch.oblique = motion.normalized();
  return touch;
}

double Violation(const planner::ContactMap& map, const Touch& touch, const Eigen::Vector3d& target, int orientation,
                 double slack_cells) {
  const Eigen::Vector3d displacement = touch.start - target;
  double least = ViolationAt(map, touch, displacement, orientation);
  for (int axis = 0; axis < 3 && slack_cells > 0.0; ++axis) {
    if (axis == AxisOf(touch.direction)) continue;
    for (const double shift : {-slack_cells, slack_cells}) {
      if (least == 0.0) return least;
      Eigen::Vector3d moved = displacement;
      moved[axis] += shift;
      least = std::min(least, ViolationAt(map, touch, moved, orientation));
    }
  }
  return least;
}

bool FacesAgree(const planner::ContactMap& map, const std::vector<Touch>& evidence, const Eigen::Vector3d& target,
                Direction insertion, int orientation) {
  const auto agreed = std::ranges::count_if(evidence, [&](const Touch& touch) {
    return touch.contact && !touch.is_oblique() && touch.direction == insertion &&
           Violation(map, touch, target, orientation, 0.0) < kFacesAgree;
  });
  return agreed >= 2;
}

TargetFit FitTarget(const planner::ContactMap& map, const std::vector<Touch>& evidence, const Eigen::Vector3d& lower,
                    const Eigen::Vector3d& upper, int orientation, const FitOptions& options) {
  const std::vector<double> xs = GridValues(lower.x(), upper.x(), options.step_cells);
  const std::vector<double> ys = GridValues(lower.y(), upper.y(), options.step_cells);
  const std::vector<double> zs = GridValues(lower.z(), upper.z(), options.step_cells);
  struct Candidate {
    Eigen::Vector3d position;
    double squares;
  };
  std::vector<Candidate> best;  // all grid points with the fewest violations so far
  int fewest = std::numeric_limits<int>::max();
  for (const double x : xs) {
    for (const double y : ys) {
      for (const double z : zs) {
        const Eigen::Vector3d position(x, y, z);
        const Score score = ScoreOf(map, evidence, position, orientation, options, fewest);
        if (score.violations > fewest || score.violations == std::numeric_limits<int>::max()) continue;
        if (score.violations < fewest) {
          fewest = score.violations;
          best.clear();
        }
        best.push_back({position, score.squares});
      }
    }
  }
  double least_squares = std::numeric_limits<double>::infinity();
  for (const Candidate& candidate : best) least_squares = std::min(least_squares, candidate.squares);
  // Points within a grid step of the least squares form the plateau along the axes that are not pinned.
  const double plateau = least_squares + options.step_cells * options.step_cells;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;
  for (const Candidate& candidate : best) {
    if (candidate.squares > plateau) continue;
    low = low.cwiseMin(candidate.position);
    high = high.cwiseMax(candidate.position);
  }
  TargetFit fit;
  fit.violations = fewest;
  fit.position = 0.5 * (low + high);
  fit.half_width = 0.5 * (high - low);
  SnapToContacts(map, evidence, orientation, options, fit);
  return fit;
}

TargetFit FitTargetAnywhere(const planner::ContactMap& map, const std::vector<Touch>& evidence,
                            const Eigen::Vector3d& lower, const Eigen::Vector3d& upper, int orientation,
                            const FitOptions& options) {
  // Coarse: a grid point explains what the truth within half a step of it on every axis would explain.
  FitOptions coarse = options;
  coarse.step_cells = 0.5;
  coarse.violation_cells += 0.5 * coarse.step_cells;
  coarse.slack_cells += 0.5 * coarse.step_cells;
  const TargetFit area = FitTarget(map, evidence, lower, upper, orientation, coarse);
  const Eigen::Vector3d reach = area.half_width + Eigen::Vector3d::Constant(1.0);
  return FitTarget(map, evidence, (area.position - reach).cwiseMax(lower).cwiseMin(upper),
                   (area.position + reach).cwiseMin(upper).cwiseMax(lower), orientation, options);
}

}  // namespace feeler::execution
