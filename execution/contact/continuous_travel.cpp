#include "feeler/execution/contact/continuous_travel.h"

#include <cmath>

namespace feeler::execution {

namespace {

/// From the lattice point `at`, or, if that is in a wall, from the free one behind it.
double TravelFrom(const planner::ContactMap& map, Cell at, Direction direction, int orientation) {
  const Cell step = UnitCell(direction);
  for (int back = 0; back <= kDeepestCells; ++back, at -= step) {
    if (!map.Blocked(at, orientation)) return static_cast<double>(map.Travel(at, direction, orientation)) - back;
  }
  return -kDeepestCells;
}

}  // namespace

double ContinuousTravel(const planner::ContactMap& map, const Eigen::Vector3d& displacement_cells, Direction direction,
                        int orientation) {
  const Eigen::Vector3d lattice = displacement_cells - map.phase();
  const Cell nearest(static_cast<int>(std::lround(lattice.x())), static_cast<int>(std::lround(lattice.y())),
                     static_cast<int>(std::lround(lattice.z())));
  const int along = AxisOf(direction);
  const double at_nearest = TravelFrom(map, nearest, direction, orientation);
  double travel = at_nearest - SignOf(direction) * (lattice[along] - nearest[along]);
  for (int axis = 0; axis < 3; ++axis) {
    const double aside = lattice[axis] - nearest[axis];
    if (axis == along || aside == 0.0) continue;
    const int side = aside > 0.0 ? 1 : -1;
    const auto slope_to = [&](int to) {
      Cell neighbour = nearest;
      neighbour[axis] += to;
      return to * (TravelFrom(map, neighbour, direction, orientation) - at_nearest);
    };
    double slope = slope_to(side);
    // Up to an edge, the wall goes on as it comes from the other side.
    if (std::abs(slope) > kSteepest) slope = slope_to(-side);
    if (std::abs(slope) <= kSteepest) travel += aside * slope;
  }
  return travel;
}

}  // namespace feeler::execution
