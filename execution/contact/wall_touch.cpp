#include "feeler/execution/contact/wall_touch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "feeler/execution/contact/confirm.h"
#include "feeler/execution/contact/free_path.h"

namespace feeler::execution {
namespace {

/// A touch begins this far from the wall, in cells.
constexpr double kNearestWall = 1.5;
constexpr double kFarthestWall = 2.5;
/// A tool that begins a touch stands off the wall by this at least, wherever it is, cells.
constexpr double kOffWall = 0.25;
/// Lines that meet the same wall differ by less than this.
constexpr double kSameTravel = 0.2;

/// The displacement on the line through `line` along `direction` from which the nearest wall, coming from outside, is
/// between kNearestWall and kFarthestWall away.
std::optional<Cell> InFront(const planner::ContactMap& map, Cell line, Direction direction, int orientation) {
  const int axis = AxisOf(direction);
  line[axis] = SignOf(direction) > 0 ? map.domain().min[axis] : map.domain().max[axis];
  if (map.Blocked(line, orientation)) return std::nullopt;
  const double travel = map.Travel(line, direction, orientation);
  if (travel > 1e6) return std::nullopt;
  const int steps = std::max(0, static_cast<int>(std::floor(travel - kNearestWall)));
  const Cell cell = line + steps * UnitCell(direction);
  return map.Travel(cell, direction, orientation) <= kFarthestWall ? std::optional(cell) : std::nullopt;
}

bool SameWall(const planner::ContactMap& map, const Cell& a, const Cell& b, Direction direction, int orientation) {
  return !map.Blocked(b, orientation) &&
         std::abs(map.Travel(a, direction, orientation) - map.Travel(b, direction, orientation)) <= kSameTravel;
}

}  // namespace

std::optional<BroadWall> FindBroadWall(const planner::ContactMap& map, Direction insertion, Direction direction,
                                       int orientation) {
  constexpr int kDeepest = 12;
  constexpr int kLeastRange = 2;
  const int depth_axis = AxisOf(insertion);
  const int along = 3 - depth_axis - AxisOf(direction);
  const Cell sideways = UnitCell(MakeDirection(along, 1));
  for (int depth = 1; depth <= kDeepest; ++depth) {
    const auto here = InFront(map, depth * UnitCell(insertion), direction, orientation);
    if (!here) continue;
    // A cell above and below it as well, so that the height need not be known exactly.
    if (!SameWall(map, *here, *here + UnitCell(insertion), direction, orientation)) continue;
    if (!SameWall(map, *here, *here - UnitCell(insertion), direction, orientation)) continue;
    int range = 0;
    while (range < 64 && SameWall(map, *here, *here + (range + 1) * sideways, direction, orientation) &&
           SameWall(map, *here, *here - (range + 1) * sideways, direction, orientation)) {
      ++range;
    }
    if (range < kLeastRange) continue;
    return BroadWall{direction, along, *here, static_cast<double>(range)};
  }
  return std::nullopt;
}

std::optional<double> TouchWall(const planner::ContactMap& map, const Eigen::Vector3d& target, int orientation,
                                const BroadWall& wall, int offset, double slack, const char* kind, Mover& mover) {
  Cell goal = wall.middle + offset * UnitCell(MakeDirection(wall.along, 1));
  while (map.Travel(goal, wall.direction, orientation) < slack + kOffWall &&
         IsClear(map, goal - UnitCell(wall.direction), orientation)) {
    goal -= UnitCell(wall.direction);
  }
  const auto path =
      FindFreePath(map, NearestFree(map, mover.position() - target, orientation), EndAt(goal), orientation, true);
  if (!path) return std::nullopt;
  std::vector<Touch> ignored;
  if (!FollowPath(map, target, *path, "transfer", mover, ignored)) return std::nullopt;
  // Where the tool stood already need not be a lattice point.
  const Eigen::Vector3d place = target + goal.cast<double>() + map.phase();
  const Eigen::Vector3d before = mover.position();
  if ((before - place).norm() > 0.05 && mover.Fast(place, "transfer").contact) {
    mover.Retreat(before);
    return std::nullopt;
  }
  const int axis = AxisOf(wall.direction);
  const int sign = SignOf(wall.direction);
  const double travel = map.Travel(goal, wall.direction, orientation);
  const double from = mover.position()[axis];
  const MotionReport report =
      mover.Probe(wall.direction, from + sign * (travel + slack), kind, std::array<double, 2>{travel, travel});
  const double met = report.end[axis];
  const double travelled = sign * (met - from);
  mover.Retreat(report.end - std::min(1.0, std::max(0.3, travelled)) * UnitVector(wall.direction));
  if (!report.contact || travelled < travel - slack) return std::nullopt;
  return met;
}

std::optional<Eigen::Vector3d> Recenter(const Task& task, const planner::ContactMap& map, const Eigen::Vector3d& target,
                                        int orientation, double slack, Mover& mover) {
  Eigen::Vector3d centre = target;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == AxisOf(task.insertion)) continue;
    double sum = 0.0;
    int sides = 0;
    for (const int sign : {1, -1}) {
      const Direction direction = MakeDirection(axis, sign);
      const auto wall = FindBroadWall(map, task.insertion, direction, orientation);
      if (!wall) continue;
      const auto met = TouchWall(map, centre, orientation, *wall, 0, slack, "confirm", mover);
      if (!met) return std::nullopt;
      const double expected = centre[axis] + wall->middle[axis] + map.phase()[axis] +
                              sign * static_cast<double>(map.Travel(wall->middle, direction, orientation));
      sum += *met - expected;
      ++sides;
    }
    if (sides > 0) centre[axis] += sum / sides;
  }
  return centre;
}

}  // namespace feeler::execution
