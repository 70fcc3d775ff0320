#include "planner/heuristic/certificate_grid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "planner/heuristic/certificate_walks.h"

namespace feeler::planner {
namespace {

/// Where costs are no multiples of a free step's, table units per free step.
constexpr std::uint32_t kUnitsPerStep = 64;

}  // namespace

StepCosts LowerStepCosts(const CostWeights& cost, int longest_move) {
  const double share = cost.per_action / longest_move;
  return {cost.per_cell + share, cost.per_contact + share};
}

StepCosts MotionCosts(const CostWeights& cost, int longest_move) {
  if (cost.per_cell <= 0.0) return LowerStepCosts(cost, longest_move);
  return {cost.per_cell, cost.per_contact, cost.per_action};
}

CertificateGrid::CertificateGrid(const ContactMap& map, const StepCosts& costs, const Cell& reach)
    : domain{map.domain().min - reach - Cell::Ones(), map.domain().max + reach + Cell::Ones()},
      size(domain.Size()),
      cells(static_cast<std::size_t>(domain.Count())) {
  const auto whole = [&](double x) { return std::fmod(x, costs.free) == 0.0; };
  free_units = whole(costs.contact) && whole(costs.start) ? 1 : kUnitsPerStep;
  unit = costs.free / free_units;
  const auto units = [&](double x) { return static_cast<std::uint32_t>(std::min(60000.0, std::floor(x / unit))); };
  contact_units = units(costs.contact);
  start_units = units(costs.start);
}

void TableCertificates(const ContactMap& map, int orientation, const CertificateGrid& grid,
                       std::span<const Cell> others, std::uint16_t* planes) {
  assert(others.size() <= 6);
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
          walks.probes.push_back({from, to, free ? grid.free_units : grid.contact_units, d, !free, shows});
        }
      }
    }
  }
  FillCertificates(walks, static_cast<int>(others.size()), planes);
}

}  // namespace feeler::planner
