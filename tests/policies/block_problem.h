#pragma once

#include <cstdlib>
#include <memory>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/planner/contact/contact_map.h"
#include "feeler/planner/family/problem_family.h"

namespace feeler::policies {

/// A block of 5 x 5 x 4 cells on a floor, walls mid-cell.
inline std::shared_ptr<const planner::ContactMap> SmallBlockMap() {
  const CellBox domain{Cell(-14, -14, -6), Cell(14, 14, 14)};
  const auto blocked = [](const Cell& d) {
    return d.z() < -4 || (std::abs(d.x()) <= 2 && std::abs(d.y()) <= 2 && d.z() < 0);
  };
  planner::ContactMap::Layer layer;
  for (int z = domain.min.z(); z <= domain.max.z(); ++z) {
    for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
      for (int x = domain.min.x(); x <= domain.max.x(); ++x) {
        const Cell here(x, y, z);
        layer.blocked.push_back(blocked(here) ? 1 : 0);
        for (const Direction d : kDirections) {
          float travel = 0.5F;
          Cell next = here + UnitCell(d);
          for (; domain.Contains(next) && !blocked(next); next += UnitCell(d)) travel += 1.0F;
          if (!domain.Contains(next)) travel = planner::ContactMap::kUnlimited;
          layer.travel[IndexOf(d)].push_back(blocked(here) ? 0.0F : travel);
        }
      }
    }
  }
  return std::make_shared<planner::ContactMap>(domain, std::vector<planner::ContactMap::Layer>{layer},
                                               Eigen::Vector3d::Zero(), 0.5);
}

inline planner::Problem SmallBlockProblem(const planner::Extents& extents) {
  Task task;
  task.start_offset_m = {0.0, 0.0, 0.008};
  task.workspace_m = {0.03, 0.03, 0.02};
  task.axes = {{AxisKind::kX, 0.002, 2, 15}, {AxisKind::kY, 0.002, 2, 15}, {AxisKind::kZ, 0.002, 2, 15}};
  return planner::MakeCuboidProblem(task, SmallBlockMap(), extents);
}

}  // namespace feeler::policies
