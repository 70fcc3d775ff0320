#include "feeler/env/contact/axis_visibility.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace feeler::env {
namespace {

using planner::ContactMap;

struct Comparison {
  double largest_cells = 0.0;
  std::int64_t probes = 0;
};

/// Probes of two hypotheses: the tool at displacement d from the one is at d + shift from the other.
Comparison Compare(const ContactMap& map, int first, int second, const Cell& shift, double longest_cells) {
  Comparison comparison;
  const CellBox& domain = map.domain();
  const auto longest = static_cast<float>(longest_cells);
  const Cell low = domain.min.cwiseMax(domain.min - shift);
  const Cell high = domain.max.cwiseMin(domain.max - shift);
  for (const Direction direction : kDirections) {
    const auto& one = map.layer(first).travel[static_cast<std::size_t>(IndexOf(direction))];
    const auto& other = map.layer(second).travel[static_cast<std::size_t>(IndexOf(direction))];
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        const std::size_t here = map.Index({low.x(), y, z});
        const std::size_t there = map.Index(Cell(low.x(), y, z) + shift);
        for (int x = 0; x <= high.x() - low.x(); ++x) {
          const auto k = static_cast<std::size_t>(x);
          // A place in the target is none under either hypothesis.
          if (map.layer(first).blocked[here + k] != 0 || map.layer(second).blocked[there + k] != 0) continue;
          const double difference =
              std::abs(double{std::min(one[here + k], longest)} - double{std::min(other[there + k], longest)});
          comparison.largest_cells = std::max(comparison.largest_cells, difference);
          if (difference > kFeltDifference_cells) ++comparison.probes;
        }
      }
    }
  }
  return comparison;
}

void Add(const Comparison& comparison, AxisVisibility& visibility) {
  visibility.largest_difference_cells = std::max(visibility.largest_difference_cells, comparison.largest_cells);
  visibility.fewest_probes =
      visibility.pairs == 0 ? comparison.probes : std::min(visibility.fewest_probes, comparison.probes);
  ++visibility.pairs;
  if (comparison.probes == 0) ++visibility.alike_pairs;
}

}  // namespace

std::vector<AxisVisibility> AxisVisibilities(const Task& task, const ContactMap& map) {
  const auto cells_of = [&](AxisKind kind) {
    for (const UncertainAxis& axis : task.axes) {
      if (axis.kind == kind) return axis.max_cells;
    }
    return 1;
  };
  const int pitches = cells_of(AxisKind::kPitch);
  const double longest_cells = task.move_lengths.back();
  std::vector<AxisVisibility> visibilities;
  for (const UncertainAxis& axis : task.axes) {
    AxisVisibility visibility;
    visibility.kind = axis.kind;
    for (int orientation = 0; orientation < map.orientations(); ++orientation) {
      if (axis.kind == AxisKind::kYaw) {
        if (orientation + pitches >= map.orientations()) continue;
        Add(Compare(map, orientation, orientation + pitches, Cell::Zero(), longest_cells), visibility);
      } else if (axis.kind == AxisKind::kPitch) {
        if (orientation % pitches == pitches - 1) continue;
        Add(Compare(map, orientation, orientation + 1, Cell::Zero(), longest_cells), visibility);
      } else {
        const Cell shift = UnitCell(MakeDirection(static_cast<int>(axis.kind), -1));
        Add(Compare(map, orientation, orientation, shift, longest_cells), visibility);
      }
    }
    visibilities.push_back(visibility);
  }
  return visibilities;
}

double ShareOfWallsNear(const ContactMap& map, double distance_cells) {
  std::int64_t walls = 0;
  std::int64_t near = 0;
  for (int orientation = 0; orientation < map.orientations(); ++orientation) {
    for (const auto& table : map.layer(orientation).travel) {
      for (const float travel : table) {
        if (travel <= 0.0F || travel >= 1.0F) continue;
        ++walls;
        if (std::min(double{travel}, 1.0 - double{travel}) < distance_cells) ++near;
      }
    }
  }
  return walls == 0 ? 0.0 : static_cast<double>(near) / static_cast<double>(walls);
}

}  // namespace feeler::env
