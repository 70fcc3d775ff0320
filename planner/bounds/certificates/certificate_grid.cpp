#include "feeler/planner/bounds/certificates/certificate_grid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "feeler/core/lattice_grid.h"
#include "feeler/planner/bounds/certificates/certificate_walks.h"
#include "feeler/planner/bounds/certificates/guarded_certificates.h"

namespace feeler::planner {
namespace {

/// Where costs are no multiples of a free step's, table units per free step.
constexpr std::uint32_t kUnitsPerStep = 64;

}  // namespace

StepCosts LowerStepCosts(const CostWeights& cost, int longest_move) {
  const double share = cost.per_action / longest_move;
  return {cost.per_cell + share, cost.per_contact + share};
}

StepCosts MotionCosts(const CostWeights& cost, const std::vector<int>& lengths) {
  if (cost.per_cell <= 0.0) return LowerStepCosts(cost, lengths.back());
  StepCosts costs{cost.per_cell, cost.per_contact, cost.per_action, {}};
  if (costs.start > 0.0 && lengths.back() <= GuardedWalks::kLongest) {
    costs.lengths = lengths;
    costs.beyond = cost.beyond_per_cell;
  }
  return costs;
}

TableUnits::TableUnits(const StepCosts& costs) {
  const auto whole = [&](double x) { return std::fmod(x, costs.free) == 0.0; };
  const double look = costs.look < 0.0 ? costs.free : costs.look;
  free_units = whole(costs.contact) && whole(costs.start) && whole(look) && std::ranges::all_of(costs.beyond, whole)
                   ? 1
                   : kUnitsPerStep;
  unit = costs.free / free_units;
  const auto units = [&](double x) { return static_cast<std::uint32_t>(std::min(60000.0, std::floor(x / unit))); };
  look_units = units(look);
  contact_units = units(costs.contact);
  start_units = units(costs.start);
  std::ranges::transform(costs.beyond, beyond_units.begin(), units);
}

CertificateGrid::CertificateGrid(const ActiveRegion& region, const StepCosts& costs, const Cell& reach)
    : TableUnits(costs),
      domain(region.box),
      free_above(region.free_above),
      free_below(region.free_below),
      lengths(costs.lengths) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    if (free_above[i]) domain.max[axis] = std::min(domain.max[axis] + kFreeMargin, region.whole.max[axis]);
    if (free_below[i]) domain.min[axis] = std::max(domain.min[axis] - kFreeMargin, region.whole.min[axis]);
  }
  domain = {domain.min - reach - Cell::Ones(), domain.max + reach + Cell::Ones()};
  size = domain.Size();
  cells = static_cast<std::size_t>(domain.Count());
}

namespace {

/// Cells that the tool is free to go in a direction, at most `longest`.
std::uint8_t TravelCells(const ContactMap& map, Cell here, Direction d, int orientation, int longest) {
  int cells = 0;
  for (; cells < longest && map.StepFree(here, d, orientation); ++cells) here += UnitCell(d);
  return static_cast<std::uint8_t>(cells);
}

void TableGuardedCertificates(const ContactMap& map, int orientation, const CertificateGrid& grid,
                              std::span<const Cell> others, std::uint16_t* planes) {
  GuardedWalks walks;
  walks.size = grid.size;
  walks.lengths = grid.lengths;
  walks.step_cost = grid.free_units;
  walks.beyond_step = grid.beyond_units;
  walks.contact_cost = grid.contact_units;
  walks.action_cost = grid.start_units;
  walks.projected = true;
  const int longest = grid.lengths.back();
  // Travel of the tool under the hypothesis, for all cells that the others see too.
  Cell reach = Cell::Zero();
  for (const Cell& other : others) reach = reach.cwiseMax(other.cwiseAbs());
  const CellBox wide{grid.domain.min - reach, grid.domain.max + reach};
  const Cell size = wide.Size();
  const auto index = [&](const Cell& here) { return GridIndex(size, here - wide.min); };
  for (const Direction d : kDirections) {
    const auto k = static_cast<std::size_t>(IndexOf(d));
    std::vector<std::uint8_t> travel;
    travel.reserve(static_cast<std::size_t>(wide.Count()));
    for (int z = wide.min.z(); z <= wide.max.z(); ++z) {
      for (int y = wide.min.y(); y <= wide.max.y(); ++y) {
        for (int x = wide.min.x(); x <= wide.max.x(); ++x) {
          travel.push_back(TravelCells(map, Cell(x, y, z), d, orientation, longest));
        }
      }
    }
    const CellBox& domain = grid.domain;
    for (int z = domain.min.z(); z <= domain.max.z(); ++z) {
      for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
        for (int x = domain.min.x(); x <= domain.max.x(); ++x) {
          const Cell here(x, y, z);
          const bool reached = StepFlags(map, here, orientation) != kOutOfReach;
          const auto cell = static_cast<std::uint32_t>(walks.travel[k].size());
          const std::uint8_t mine = travel[index(here)];
          walks.travel[k].push_back(mine);
          walks.longest[k].push_back(static_cast<std::uint8_t>(reached ? longest : 0));
          if (!reached) continue;
          GuardedWalks::Telling telling{cell, d, {}};
          bool tells = false;
          for (std::size_t i = 0; i < others.size(); ++i) {
            telling.travel[i] = travel[index(here - others[i])];
            tells = tells || telling.travel[i] != mine;
          }
          if (tells) walks.telling.push_back(telling);
        }
      }
    }
  }
  FillGuardedCertificates(walks, static_cast<int>(others.size()), planes);
}

}  // namespace

void TableCertificates(const ContactMap& map, int orientation, const CertificateGrid& grid,
                       std::span<const Cell> others, std::uint16_t* planes) {
  assert(others.size() <= 6);
  if (!grid.lengths.empty()) {
    TableGuardedCertificates(map, orientation, grid, others, planes);
    return;
  }
  CertificateWalks walks;
  walks.strides = grid.strides();
  walks.step_cost = grid.free_units;
  walks.start_cost = grid.start_units;
  walks.enters.assign(grid.cells, 0);
  const CellBox& domain = grid.domain;
  for (int z = domain.min.z(); z <= domain.max.z(); ++z) {
    for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
      for (int x = domain.min.x(); x <= domain.max.x(); ++x) {
        const Cell here(x, y, z);
        if (map.Blocked(here, orientation)) continue;
        const auto from = static_cast<std::uint32_t>(grid.Index(here));
        for (const Direction d : kDirections) {
          const bool free = map.StepFree(here, d, orientation);
          std::uint8_t shows = 0;
          for (std::size_t i = 0; i < others.size(); ++i) {
            if (map.StepFree(here - others[i], d, orientation) != free) shows |= static_cast<std::uint8_t>(1U << i);
          }
          std::uint32_t to = from;
          if (free && domain.Contains(here + UnitCell(d))) {
            to = static_cast<std::uint32_t>(static_cast<std::int64_t>(from) +
                                            SignOf(d) * walks.strides[static_cast<std::size_t>(AxisOf(d))]);
            walks.enters[to] |= static_cast<std::uint8_t>(1U << IndexOf(d));
          }
          // A free step out of the domain shows what its projection, staying in place, would show.
          if (shows == 0) continue;
          walks.probes.push_back({from, to, free ? grid.look_units : grid.contact_units, d, !free, shows});
        }
      }
    }
  }
  FillCertificates(walks, static_cast<int>(others.size()), planes);
}

}  // namespace feeler::planner
