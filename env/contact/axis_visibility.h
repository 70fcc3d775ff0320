#pragma once

#include <cstdint>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::env {

/// How well contact tells neighbouring hypotheses along an uncertain axis apart.
struct AxisVisibility {
  AxisKind kind = AxisKind::kX;
  /// Over all places and directions of the tool, the largest difference in travel between two neighbours, in cells (at
  /// most the longest move).
  double largest_difference_cells = 0.0;
  /// Probes (a place and a direction) that tell the two neighbours apart that are most alike, over all orientations.
  std::int64_t fewest_probes = 0;
  /// Neighbours that no probe tells apart, of how many.
  int alike_pairs = 0;
  int pairs = 0;

  /// False: contact cannot see this axis, as the turn of a round pipe about its own axis.
  bool felt() const { return alike_pairs < pairs; }
};

/// A probe tells two hypotheses apart if its travel differs by more than this: three tenths of a millimetre at 2 mm,
/// what touch resolves.
inline constexpr double kFeltDifference_cells = 0.15;

/// For every uncertain axis of the task, by comparing the travel of all probes of the map within its domain.
std::vector<AxisVisibility> AxisVisibilities(const Task& task, const planner::ContactMap& map);

/// Share of the walls within a cell of a lattice point that lie nearer than `distance_cells` to a lattice plane, over
/// all orientations and directions: where a truth between lattice points can read as the outcome of a neighbour.
double ShareOfWallsNear(const planner::ContactMap& map, double distance_cells);

}  // namespace feeler::env
