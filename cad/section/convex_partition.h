#pragma once

#include <optional>
#include <vector>

#include "feeler/cad/section/section.h"

namespace feeler::cad {

/// Cuts a cross-section (loops around material and around holes) into convex polygons, counterclockwise. A cut begins
/// at a corner where the material spans more than half a turn and ends at the nearest good place: another such corner,
/// or a side that it meets squarely, so that a rectangular hole leaves rectangles and a round one wedges. Corners that
/// are not convex by `tolerance_m` or less stay, as long as none is deeper than that below the polygon's hull. A
/// polygon's points are those of the loops, and such on their sides; deterministic. A cut is plane over the whole slab,
/// so that what is convex in its middle is convex at its ends. `plane_only`: nothing where there is no such cut (a
/// thinner slab may have one); else it is taken as it comes.
std::optional<std::vector<SlabLoop>> ConvexPartition(const std::vector<SlabLoop>& loops, double tolerance_m,
                                                     bool plane_only);

}  // namespace feeler::cad
