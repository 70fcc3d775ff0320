#pragma once

#include <vector>

#include "feeler/cad/section/section.h"

namespace feeler::cad {

/// Cuts a cross-section (loops around material and around holes) into convex polygons, counterclockwise. A cut begins
/// at a corner where the material spans more than half a turn and ends at the nearest good place: another such corner,
/// or a side that it meets squarely, so that a rectangular hole leaves rectangles and a round one wedges. Corners that
/// are not convex by `tolerance_m` or less stay. A polygon's points are those of the loops, and such on their sides;
/// deterministic.
std::vector<SlabLoop> ConvexPartition(const std::vector<SlabLoop>& loops, double tolerance_m);

}  // namespace feeler::cad
