#include "execution/continuous_travel.h"

#include <cmath>

namespace feeler::execution {

double ContinuousTravel(const planner::ContactMap& map, const Eigen::Vector3d& displacement_cells, Direction direction,
                        int orientation) {
  const Eigen::Vector3d lattice = displacement_cells - map.phase();
  Cell nearest(static_cast<int>(std::lround(lattice.x())), static_cast<int>(std::lround(lattice.y())),
               static_cast<int>(std::lround(lattice.z())));
  const int axis = AxisOf(direction);
  const double ahead = SignOf(direction) * (lattice[axis] - nearest[axis]);
  const Cell step = UnitCell(direction);
  for (int back = 0; back <= kDeepestCells; ++back, nearest -= step) {
    if (!map.Blocked(nearest, orientation)) {
      return static_cast<double>(map.Travel(nearest, direction, orientation)) - back - ahead;
    }
  }
  return -kDeepestCells;
}

}  // namespace feeler::execution
