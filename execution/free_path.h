#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/lattice.h"
#include "planner/contact/contact_map.h"

namespace feeler::execution {

/// True if the tool is clear of the target at this displacement and at all 26 around it: at least one cell of room
/// beyond the half cell by which a displacement may be rounded.
bool IsClear(const planner::ContactMap& map, const Cell& displacement, int orientation = 0);

/// Shortest way of the tool through the free displacements around the target, in lattice steps, from `start` to the
/// nearest displacement that satisfies `goal`, cut to the few corners between which straight lines stay clear (the
/// first is `start`). Displacements that are free but not clear are crossed only where nothing else is left, as near a
/// wall that was just touched. Searches the domain of the map grown by two cells, and `start`. Empty: there is no way.
std::optional<std::vector<Cell>> FindFreePath(const planner::ContactMap& map, const Cell& start,
                                              const std::function<bool(const Cell&)>& goal, int orientation = 0);

/// The free displacement nearest to a continuous one (cells), within two cells; the nearest lattice point if none is.
/// A tool beside a wall may round into it.
Cell NearestFree(const planner::ContactMap& map, const Eigen::Vector3d& displacement_cells, int orientation = 0);

}  // namespace feeler::execution
