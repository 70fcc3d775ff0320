#include "feeler/planner/contact/fill_dead_ends.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "feeler/core/lattice_grid.h"

namespace feeler::planner {
std::shared_ptr<const ContactMap> FillDeadEnds(const ContactMap& map) {
  const CellBox& domain = map.domain();
  std::vector<ContactMap::Layer> layers;
  bool any = false;
  for (int o = 0; o < map.orientations(); ++o) {
    std::vector<char> filled(static_cast<std::size_t>(domain.Count()), 0);
    const auto dead_end = [&](const Cell& here) {
      if (map.Blocked(here, o) || filled[map.Index(here)] != 0) return false;
      int ways = 0;
      for (const Direction d : kDirections) {
        const Cell next = here + UnitCell(d);
        if (!map.StepFree(here, d, o)) continue;
        if (!domain.Contains(next)) return false;
        if (!map.Blocked(next, o) && filled[map.Index(next)] == 0) ++ways;
      }
      return ways <= 1;
    };
    std::vector<Cell> open;
    ForEachCell(domain, [&](const Cell& here) {
      if (dead_end(here)) open.push_back(here);
    });
    while (!open.empty()) {
      const Cell here = open.back();
      open.pop_back();
      if (!dead_end(here)) continue;
      filled[map.Index(here)] = 1;
      any = true;
      for (const Direction d : kDirections) {
        const Cell next = here + UnitCell(d);
        if (domain.Contains(next) && dead_end(next)) open.push_back(next);
      }
    }
    ContactMap::Layer layer = map.CopyOfLayer(o);
    ForEachCell(domain, [&](const Cell& cell) {
      if (filled[map.Index(cell)] == 0) return;
      layer.blocked[map.Index(cell)] = 1;
      for (const Direction d : kDirections) {
        std::vector<float>& travel = layer.travel[IndexOf(d)];
        travel[map.Index(cell)] = 0.0F;
        // Who would have come into the cell stops half a cell before it.
        Cell here = cell;
        for (float reach = 0.5F;; reach += 1.0F) {
          here -= UnitCell(d);
          if (!domain.Contains(here) || !map.StepFree(here, d, o)) break;
          float& from_here = travel[map.Index(here)];
          from_here = std::min(from_here, reach);
        }
      }
    });
    layers.push_back(std::move(layer));
  }
  if (!any) return nullptr;
  return std::make_shared<const ContactMap>(domain, std::move(layers), map.phase(), map.margin_cells());
}

}  // namespace feeler::planner
