#include "feeler/execution/lattice/yaw_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "feeler/execution/contact/continuous_travel.h"
#include "feeler/execution/contact/wall_touch.h"

namespace feeler::execution {
namespace {

/// Part of a wall's flat range, to both sides of its middle, in which a turned target is met by a corner of the tool.
constexpr double kInnerPart = 0.42;
/// The middle of a wall is met this near to where it is expected, cells.
constexpr double kMiddleOff = 1.5;

/// Coordinate at contact over the place along the wall, for a target turned by one radian.
double SlopePerRadian(Direction insertion, int along, int axis) {
  const Eigen::Vector3d turned = (-UnitVector(insertion)).cross(Eigen::Vector3d::Unit(along));
  return turned[axis];
}

}  // namespace

std::optional<YawFit> YawFromEvidence(const planner::ContactMap& map, Direction insertion,
                                      const std::vector<Touch>& evidence, const Eigen::Vector3d& target,
                                      int orientation, double least_baseline_cells) {
  std::optional<YawFit> best;
  for (const Direction direction : kDirections) {
    if (AxisOf(direction) == AxisOf(insertion)) continue;
    const auto wall = FindBroadWall(map, insertion, direction, orientation);
    if (!wall) continue;
    const int axis = AxisOf(direction);
    const double face = wall->middle[axis] + map.phase()[axis] +
                        SignOf(direction) * static_cast<double>(map.Travel(wall->middle, direction, orientation));
    const double middle = wall->middle[wall->along] + map.phase()[wall->along];
    double n = 0.0, sum_t = 0.0, sum_c = 0.0, sum_tt = 0.0, sum_tc = 0.0;
    double least = 1e9, greatest = -1e9;
    for (const Touch& touch : evidence) {
      if (!touch.contact || touch.is_oblique() || touch.direction != direction) continue;
      const Eigen::Vector3d place = touch.end() - target;
      const double t = place[wall->along] - middle;
      if (std::abs(t) > kInnerPart * wall->half_range) continue;
      if (std::abs(place[axis] - face) > kMiddleOff + std::abs(t) * std::tan(kLargestTurn_rad)) continue;
      const double c = place[axis];
      n += 1.0;
      sum_t += t;
      sum_c += c;
      sum_tt += t * t;
      sum_tc += t * c;
      least = std::min(least, t);
      greatest = std::max(greatest, t);
    }
    const double spread = n * sum_tt - sum_t * sum_t;
    if (greatest - least < least_baseline_cells || spread <= 0.0) continue;
    if (best && best->baseline_cells >= greatest - least) continue;
    const double slope = (n * sum_tc - sum_t * sum_c) / spread;
    best = YawFit{std::atan(slope / SlopePerRadian(insertion, wall->along, axis)), greatest - least};
    best->middle[axis] = (sum_c - slope * sum_t) / n - face;
  }
  return best;
}

std::optional<YawFit> MeasureYaw(const Task& task, const planner::ContactMap& map, const Eigen::Vector3d& target,
                                 int orientation, Mover& mover, std::vector<Touch>& evidence) {
  constexpr int kLeastOffset = 2;
  std::optional<BroadWall> widest;
  double nearest = 0.0;
  for (const Direction direction : kDirections) {
    if (AxisOf(direction) == AxisOf(task.insertion)) continue;
    const auto wall = FindBroadWall(map, task.insertion, direction, orientation);
    if (!wall) continue;
    const double distance = (mover.position() - target - wall->middle.cast<double>()).norm();
    if (widest && wall->half_range < widest->half_range) continue;
    if (widest && wall->half_range == widest->half_range && distance >= nearest) continue;
    widest = wall;
    nearest = distance;
  }
  if (!widest) return std::nullopt;
  const int offset = static_cast<int>(std::floor(kInnerPart * widest->half_range - 0.5));
  if (offset < kLeastOffset) return std::nullopt;
  const int axis = AxisOf(widest->direction);
  const double here = (mover.position() - target)[widest->along];
  // Out here the wall stands nearer or farther by the turn.
  const double slack = kMiddleOff + offset * std::tan(kLargestTurn_rad);
  for (const int side : {here < 0.0 ? -1 : 1, here < 0.0 ? 1 : -1}) {
    const auto met = TouchWall(map, target, orientation, *widest, side * offset, slack, "yaw", mover);
    if (!met) return std::nullopt;
    Touch touch;
    touch.direction = widest->direction;
    touch.contact = true;
    touch.start = mover.position();
    touch.travelled = SignOf(touch.direction) * (*met - touch.start[axis]);
    evidence.push_back(touch);
  }
  return YawFromEvidence(map, task.insertion, evidence, target, orientation);
}

LatticeFrame TurnedFrame(const LatticeFrame& frame, Direction insertion, const Eigen::Vector3d& target,
                         double yaw_rad) {
  LatticeFrame turned;
  turned.world_T_estimate = frame.ToWorld(target);
  turned.world_T_estimate.linear() =
      turned.world_T_estimate.linear() * Eigen::AngleAxisd(yaw_rad, -UnitVector(insertion)).toRotationMatrix();
  turned.cell_m = frame.cell_m;
  return turned;
}

}  // namespace feeler::execution
