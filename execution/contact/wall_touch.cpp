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
/// A wall that is not where it was expected is looked for within so many times the slack.
constexpr double kFartherOff = 2.0;
/// After a touch the tool goes as far off as the wall may be off, within these, cells.
constexpr double kLeastOff = 1.0;
constexpr double kMostOff = 4.0;
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

/// Around a target that may not be where it is thought to be. False: there is no way, or something met on it.
bool GoTo(const planner::ContactMap& map, const Eigen::Vector3d& target, int orientation, const Cell& goal,
          Mover& mover) {
  const Cell here = NearestFree(map, mover.position() - target, orientation);
  const auto path = FindFreePath(map, here, EndAt(goal), orientation, true);
  std::vector<Touch> ignored;
  return path && FollowPath(map, target, *path, "transfer", mover, ignored);
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
  const int axis = AxisOf(wall.direction);
  // First as far out as the touch begins, then along the wall: one that stands farther out is not met on the way.
  Cell beside = NearestFree(map, mover.position() - target, orientation);
  beside[axis] = goal[axis];
  if (IsClear(map, beside, orientation) && !GoTo(map, target, orientation, beside, mover)) return std::nullopt;
  if (!GoTo(map, target, orientation, goal, mover)) return std::nullopt;
  // Where the tool stood already need not be a lattice point.
  const Eigen::Vector3d place = target + goal.cast<double>() + map.phase();
  const Eigen::Vector3d before = mover.position();
  if ((before - place).norm() > 0.05 && mover.Fast(place, "transfer").contact) {
    mover.Retreat(before);
    return std::nullopt;
  }
  const int sign = SignOf(wall.direction);
  const double travel = map.Travel(goal, wall.direction, orientation);
  const double from = mover.position()[axis];
  const MotionReport report =
      mover.Probe(wall.direction, from + sign * (travel + slack), kind, std::array<double, 2>{travel, travel});
  const double met = report.end[axis];
  const double travelled = sign * (met - from);
  // Along the wall, which may be turned, goes on what comes next.
  const double off = std::clamp(slack, kLeastOff, kMostOff);
  mover.Retreat(report.end - std::min(off, std::max(0.3, travelled)) * UnitVector(wall.direction));
  if (!report.contact || travelled < travel - slack) return std::nullopt;
  return met;
}

std::optional<Eigen::Vector3d> Recenter(const Task& task, const planner::ContactMap& map, const Eigen::Vector3d& target,
                                        int orientation, Sides sides, double slack, Mover& mover) {
  std::vector<BroadWall> walls;
  for (const Direction direction : kDirections) {
    if (AxisOf(direction) == AxisOf(task.insertion)) continue;
    if (const auto wall = FindBroadWall(map, task.insertion, direction, orientation)) walls.push_back(*wall);
  }
  Eigen::Vector3d centre = target;
  std::array<int, 3> touched{};
  while (!walls.empty()) {
    const Eigen::Vector3d here = mover.position() - centre;
    const auto nearest = std::ranges::min_element(
        walls, {}, [&](const BroadWall& wall) { return (here - wall.middle.cast<double>()).norm(); });
    const BroadWall wall = *nearest;
    walls.erase(nearest);
    const int axis = AxisOf(wall.direction);
    auto met = TouchWall(map, centre, orientation, wall, 0, slack, "confirm", mover);
    // One that stands farther off than thought is not met, or met on the way to it: from farther off, once more.
    if (!met) met = TouchWall(map, centre, orientation, wall, 0, kFartherOff * slack, "confirm", mover);
    if (!met) return std::nullopt;
    const double expected =
        centre[axis] + wall.middle[axis] + map.phase()[axis] +
        SignOf(wall.direction) * static_cast<double>(map.Travel(wall.middle, wall.direction, orientation));
    centre[axis] += (*met - expected) / ++touched[static_cast<std::size_t>(axis)];  // the mean over the sides
    if (sides == Sides::kNearest) {
      std::erase_if(walls, [&](const BroadWall& other) { return AxisOf(other.direction) == axis; });
    }
  }
  return centre;
}

}  // namespace feeler::execution
