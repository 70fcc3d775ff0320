#pragma once

#include <Eigen/Core>

#include "feeler/core/direction.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::execution {

/// Travel to contact, in cells, from a continuous displacement of the tool from the target (cells). Along the axis of
/// motion the value is exact as far as the contact map is; across it a slanted wall (one that lies a little farther
/// from the neighbouring line) is interpolated, and at an edge the displacement is rounded to the nearest lattice
/// point, which is right where edges stand mid-cell. Negative inside a wall, as far as `kDeepest` cells;
/// ContactMap::kUnlimited and more where nothing is met.
double ContinuousTravel(const planner::ContactMap& map, const Eigen::Vector3d& displacement_cells, Direction direction,
                        int orientation = 0);

/// Deeper than this inside a wall the travel is reported as -kDeepest.
inline constexpr int kDeepestCells = 3;
/// Neighbouring lines whose travel differs by more than this meet different walls, in cells.
inline constexpr double kSteepest = 1.5;

}  // namespace feeler::execution
