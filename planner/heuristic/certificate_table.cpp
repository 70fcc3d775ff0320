#include "planner/heuristic/certificate_table.h"

#include <algorithm>
#include <cmath>

#include "planner/heuristic/certificate_walks.h"

namespace feeler::planner {
namespace {

/// Two cells beyond the domain of the map all that is left is what repeats for ever, and a walk there can be projected
/// back.
constexpr int kBorder = 2;
/// Where contacts cost something, table units per free step.
constexpr std::uint32_t kUnitsPerStep = 64;

}  // namespace

StepCosts LowerStepCosts(const CostWeights& cost, int longest_move) {
  const double share = cost.per_action / longest_move;
  return {cost.per_cell + share, cost.per_contact + share};
}

CertificateTable::CertificateTable(const ContactMap& map, const StepCosts& costs, const Cell& spread) {
  domain_ = {map.domain().min - Cell::Constant(kBorder), map.domain().max + Cell::Constant(kBorder)};
  size_ = domain_.Size();
  orientations_ = map.orientations();
  plane_size_ = static_cast<std::size_t>(domain_.Count());
  for (const Direction d : kDirections) {
    neighbours_[static_cast<std::size_t>(IndexOf(d))] = (spread[AxisOf(d)] + 1) * UnitCell(d);
  }
  const std::uint32_t free_units = costs.contact > 0.0 ? kUnitsPerStep : 1;
  unit_ = costs.free / free_units;
  const auto contact_units = static_cast<std::uint32_t>(std::min(60000.0, std::floor(costs.contact / unit_)));
  values_.assign(plane_size_ * kMasks * static_cast<std::size_t>(orientations_), 0);
  for (int o = 0; o < orientations_; ++o) FillOrientation(map, o, free_units, contact_units);
}

void CertificateTable::FillOrientation(const ContactMap& map, int orientation, std::uint32_t free_units,
                                       std::uint32_t contact_units) {
  CertificateWalks walks;
  walks.strides = strides();
  walks.step_cost = free_units;
  std::vector<std::uint8_t>& enters = walks.enters;
  enters.assign(plane_size_, 0);
  for (int z = domain_.min.z(); z <= domain_.max.z(); ++z) {
    for (int y = domain_.min.y(); y <= domain_.max.y(); ++y) {
      for (int x = domain_.min.x(); x <= domain_.max.x(); ++x) {
        const Cell here(x, y, z);
        if (map.Blocked(here, orientation)) continue;
        const auto from = static_cast<std::uint32_t>(Index(here));
        for (const Direction d : kDirections) {
          const bool free = map.StepFree(here, d, orientation);
          std::uint8_t shows = 0;
          for (std::size_t i = 0; i < neighbours_.size(); ++i) {
            if (map.StepFree(here - neighbours_[i], d, orientation) != free)
              shows |= static_cast<std::uint8_t>(1U << i);
          }
          const bool inside = domain_.Contains(here + UnitCell(d));
          std::uint32_t to = from;
          if (free && inside) {
            to = static_cast<std::uint32_t>(static_cast<std::int64_t>(from) +
                                            SignOf(d) * walks.strides[static_cast<std::size_t>(AxisOf(d))]);
            enters[to] |= static_cast<std::uint8_t>(1U << IndexOf(d));
          }
          // A free step out of the domain shows what its projection, staying in place, would show.
          if (shows == 0) continue;
          const std::uint32_t cost = to == from ? std::min(free_units, contact_units) : free_units;
          walks.probes.push_back({from, to, cost, shows});
        }
      }
    }
  }

  FillCertificates(walks, 6, &values_[static_cast<std::size_t>(orientation * kMasks) * plane_size_]);
}

}  // namespace feeler::planner
