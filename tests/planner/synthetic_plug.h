#pragma once

#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner::testing {

/// A plug-like task without models: the configuration-space obstacle of a plug and a housing is a box of 82 x 66 x 30
/// mm on a panel, at 2 mm cells, walls at mid-cell. Closed: the box is solid. Open: a hole one cell wide and ten deep
/// in its middle.
/// `half`: half extents of the box along x and y, its height along z. `cut`: cells taken off its upright corners, by a
/// wall at 45 degrees.
inline std::shared_ptr<const ContactMap> MakePlugMap(bool open = false, const Cell& half = Cell(20, 16, 15),
                                                     int cut = 0) {
  const CellBox domain{-half - Cell(22, 22, 3), half + Cell(22, 22, 19)};
  const auto blocked = [&](const Cell& d) {
    if (d.z() < -half.z()) return true;  // the panel
    const int beyond = std::abs(d.x()) + std::abs(d.y()) - (half.x() + half.y() - cut);
    const bool in_box = std::abs(d.x()) <= half.x() && std::abs(d.y()) <= half.y() && d.z() < 0 && beyond <= 0;
    const bool in_hole = open && d.x() == 0 && d.y() == 0 && d.z() >= -10;
    return in_box && !in_hole;
  };
  const auto count = static_cast<std::size_t>(domain.Count());
  ContactMap::Layer layer;
  layer.blocked.resize(count);
  for (auto& travel : layer.travel) travel.assign(count, 0.0F);
  std::size_t i = 0;
  for (int z = domain.min.z(); z <= domain.max.z(); ++z) {
    for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
      for (int x = domain.min.x(); x <= domain.max.x(); ++x, ++i) {
        const Cell here(x, y, z);
        layer.blocked[i] = blocked(here) ? 1 : 0;
        if (blocked(here)) continue;
        for (const Direction d : kDirections) {
          float travel = 0.5F;
          Cell next = here + UnitCell(d);
          while (domain.Contains(next) && !blocked(next)) {
            travel += 1.0F;
            next += UnitCell(d);
          }
          layer.travel[static_cast<std::size_t>(IndexOf(d))][i] =
              domain.Contains(next) ? travel : ContactMap::kUnlimited;
        }
      }
    }
  }
  std::vector<ContactMap::Layer> layers;
  layers.push_back(std::move(layer));
  return std::make_shared<ContactMap>(domain, std::move(layers), Eigen::Vector3d(0.0, 0.0, 0.5), 0.5);
}

/// The numbers of the plug task: three uncertain axes of 2..15 cells, start 12 cells above the centre of the cuboid.
inline Task MakePlugTask() {
  Task task;
  task.name = "synthetic-plug";
  task.axes = {{AxisKind::kX, 0.002, 2, 15}, {AxisKind::kY, 0.002, 2, 15}, {AxisKind::kZ, 0.002, 2, 15}};
  task.start_offset_m = Eigen::Vector3d(0.0, 0.0, 0.024);
  task.insertion_depth_m = 0.02;
  task.workspace_m = Eigen::Vector3d(0.2, 0.2, 0.1);
  return task;
}

}  // namespace feeler::planner::testing
