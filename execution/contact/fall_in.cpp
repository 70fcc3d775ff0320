#include "feeler/execution/contact/fall_in.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "feeler/execution/contact/continuous_travel.h"

namespace feeler::execution {
namespace {

/// Across the insertion: half a cell to the nearest hypothesis, and what clearance and chamfer may add.
constexpr double kReach = 1.25;
/// Out of the opening the tool stands this far above the highest mouth, in cells.
constexpr double kAbove = 2.0;

/// Of a motion that is to meet a wall of the opening, shortfalls behind where that may stand.
constexpr double kBehindWall = 4.0;

/// As deep as a tool stands in an opening that it cannot go through, cells.
double DeepestOf(const Task& task) { return task.insertion_depth_m / task.cell_m + 1.0; }

/// Those that the tool stands less than `deepest` below, cells.
std::vector<Eigen::Vector3d> MouthsOverTool(const Task& task, const planner::Problem& problem,
                                            const Eigen::Vector3d& tool, double deepest) {
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  std::vector<Eigen::Vector3d> mouths;
  for (const planner::Hypothesis& h : problem.hypotheses) {
    const Eigen::Vector3d displacement = tool - h.offset.cast<double>();
    const double depth = displacement.dot(inward);
    Eigen::Vector3d across = displacement;
    across[AxisOf(task.insertion)] = 0.0;
    if (across.cwiseAbs().maxCoeff() <= kReach && depth > kAtMouth && depth < deepest) {
      mouths.push_back(h.offset.cast<double>());
    }
  }
  return mouths;
}

/// The walls of an opening hold a tool that is inside.
const MayMeet kInside{.long_wall = true, .edge_towards = std::nullopt};

/// Middle between the walls on both sides along `axis`; empty if one is missing. The tool ends in the middle.
std::optional<double> MiddleBetweenWalls(const Task& task, int axis, Mover& mover) {
  const double range = FarthestWallInside(task, mover) + mover.Cells(kBehindWall * mover.options().shortfall_m);
  const Eigen::Vector3d begun = mover.position();
  std::array<double, 2> walls{};
  for (const int sign : {1, -1}) {
    const MotionReport report =
        mover.Probe(MakeDirection(axis, sign), begun[axis] + sign * range, "fall-in", PredictedCells{}, kInside);
    walls[sign > 0 ? 0 : 1] = report.end[axis];
    if (report.contact) continue;  // from wall to wall: a fast way back might end at the other one
    // No wall: it was not inside, and what it slid over on the way may be met on the way back.
    mover.Probe(MakeDirection(axis, -sign), begun[axis], "fall-in", PredictedCells{}, kInside);
    return std::nullopt;
  }
  Eigen::Vector3d middle = begun;
  middle[axis] = 0.5 * (walls[0] + walls[1]);
  mover.Retreat(middle);
  return middle[axis];
}

/// A step aside from the mouth after which the tool meets the face beside it as if the opening were closed.
std::optional<Eigen::Vector3d> StepAside(const planner::ContactMap& map, Direction insertion,
                                         const Eigen::Vector3d& displacement) {
  const double closed = ContinuousTravel(map, displacement, insertion);
  for (const double cells : {4.0, 3.0, 2.0, 6.0, 8.0}) {
    for (const Direction d : kDirections) {
      if (AxisOf(d) == AxisOf(insertion)) continue;
      const auto level = [&](double c) {
        return std::abs(ContinuousTravel(map, displacement + c * UnitVector(d), insertion) - closed) < 0.2;
      };
      if (level(cells - 1.0) && level(cells) && level(cells + 1.0)) return cells * UnitVector(d);
    }
  }
  return std::nullopt;
}

}  // namespace

double FarthestWallInside(const Task& task, const Mover& mover) {
  return mover.Cells(2.0 * task.tolerance.LargestLateral() + mover.options().shortfall_m);
}

std::optional<double> DeepestInside(const Task& task, const planner::Problem& problem, const Eigen::Vector3d& tool) {
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  std::optional<double> deepest;
  for (const Eigen::Vector3d& mouth : MouthsOverTool(task, problem, tool, DeepestOf(task))) {
    deepest = std::max(deepest.value_or(kAtMouth), (tool - mouth).dot(inward));
  }
  return deepest;
}

bool MayHaveFallenIn(const Task& task, const planner::Problem& problem, const Eigen::Vector3d& tool,
                     double least_depth) {
  return DeepestInside(task, problem, tool).value_or(least_depth) > least_depth;
}

std::optional<Eigen::Vector3d> LocateFromInside(const Task& task, const planner::Problem& problem, Mover& mover) {
  const planner::ContactMap& map = *problem.map;
  const int axis = AxisOf(task.insertion);
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  if (!MayHaveFallenIn(task, problem, mover.position())) return std::nullopt;
  // An opening may go through, and hold the tool deeper than it is inserted.
  const std::vector<Eigen::Vector3d> mouths =
      MouthsOverTool(task, problem, mover.position(), std::numeric_limits<double>::infinity());
  Eigen::Vector3d target = mouths.front();
  for (int across = 0; across < 3; ++across) {
    if (across == axis) continue;
    const auto middle = MiddleBetweenWalls(task, across, mover);
    if (!middle) return std::nullopt;
    target[across] = *middle;
  }
  double highest = mouths.front()[axis];
  double lowest = highest;
  for (const Eigen::Vector3d& mouth : mouths) {
    highest = SignOf(task.insertion) * mouth[axis] < SignOf(task.insertion) * highest ? mouth[axis] : highest;
    lowest = SignOf(task.insertion) * mouth[axis] > SignOf(task.insertion) * lowest ? mouth[axis] : lowest;
  }
  // Out again, then onto the face beside the mouth.
  Eigen::Vector3d above = mover.position();
  above[axis] = highest - kAbove * inward[axis];
  mover.Retreat(above);
  target[axis] = highest;
  const auto aside = StepAside(map, task.insertion, above - target);
  if (!aside) return std::nullopt;
  if (mover.Fast(above + *aside, "transfer").contact) return std::nullopt;
  const double from = mover.position()[axis];
  const double travel = ContinuousTravel(map, mover.position() - target, task.insertion);
  const double farthest = travel + std::abs(lowest - highest) + 0.5 + mover.options().sure_overtravel_cells;
  const MotionReport report = mover.Probe(task.insertion, from + inward[axis] * farthest, "confirm",
                                          std::array<double, 2>{travel - 0.5, farthest});
  const double travelled = inward[axis] * (report.end[axis] - from);
  mover.Retreat(report.end - inward);
  if (!report.contact) return std::nullopt;
  target[axis] += inward[axis] * (travelled - travel);
  return target;
}

}  // namespace feeler::execution
