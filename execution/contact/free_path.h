#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::execution {

/// True if the tool is clear of the target at this displacement and at all 26 around it: at least one cell of room
/// beyond the half cell by which a displacement may be rounded.
bool IsClear(const planner::ContactMap& map, const Cell& displacement, int orientation = 0);

/// For a displacement that a path may end at, the time of what follows from there; empty where it may not end. In units
/// of the time of a motion of one cell from rest to rest; short motions take time as the square root of their length.
using PathGoal = std::function<std::optional<double>(const Cell&)>;
PathGoal EndAt(const Cell& goal);

/// A quick way of the tool through the free displacements around the target, from `start` to a goal; the tool comes to
/// rest at each way point, and `start` is the first. Of the goals nearby (by lattice steps), each reached by the
/// shortest lattice path with straight lines in place of its steps, or by way of one point only, whatever takes the
/// least time. Lines stay clear. Displacements that are free but not clear are crossed only where nothing else is left,
/// as near a wall that was just touched, which a line may leave at an angle. Searches the domain of the map grown by
/// two cells, and `start`. Empty: there is no way.
///
/// With `care`, for a target that may be turned or not where it is thought to be, the tool keeps to the lattice path to
/// the nearest goal, which leaves walls squarely and goes around corners, cut only between its own corners.
std::optional<std::vector<Cell>> FindFreePath(const planner::ContactMap& map, const Cell& start, const PathGoal& goal,
                                              int orientation = 0, bool care = false);

/// The free displacement nearest to a continuous one (cells), within two cells; the nearest lattice point if none is.
/// A tool beside a wall may round into it.
Cell NearestFree(const planner::ContactMap& map, const Eigen::Vector3d& displacement_cells, int orientation = 0);

}  // namespace feeler::execution
