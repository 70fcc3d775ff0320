#include "planner/heuristic/certificate_table.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace feeler::planner {
namespace {

constexpr std::uint32_t kInfinite = ~std::uint32_t{0};
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
  struct Probe {  // a step that shows something
    std::uint32_t from;
    std::uint32_t to;    // equal to `from` where blocked
    std::uint8_t shows;  // neighbours that would return something else
  };
  std::vector<Probe> probes;
  std::vector<std::uint8_t> enters(plane_size_, 0);  // bit d: the step in direction d into this cell is free
  const auto strides_of = strides();
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
                                            SignOf(d) * strides_of[static_cast<std::size_t>(AxisOf(d))]);
            enters[to] |= static_cast<std::uint8_t>(1U << IndexOf(d));
          }
          // A free step out of the domain shows what its projection, staying in place, would show.
          if (shows != 0) probes.push_back({from, to, shows});
        }
      }
    }
  }

  // Masks by number of neighbours: a probe leads to a smaller mask, a step that shows nothing stays in its mask.
  std::array<int, kMasks> masks;
  for (int m = 0; m < kMasks; ++m) masks[static_cast<std::size_t>(m)] = m;
  std::ranges::stable_sort(masks, {}, [](int m) { return std::popcount(static_cast<unsigned>(m)); });
  std::vector<std::uint32_t> cost(plane_size_);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> seeds;  // cost, cell
  std::vector<std::pair<std::uint32_t, std::uint32_t>> queue;
  std::uint16_t* const planes = &values_[static_cast<std::size_t>(orientation * kMasks) * plane_size_];
  for (const int mask : masks) {
    if (mask == 0) continue;
    std::ranges::fill(cost, kInfinite);
    seeds.clear();
    for (const Probe& probe : probes) {
      if ((probe.shows & mask) == 0) continue;
      const std::uint16_t rest = planes[static_cast<std::size_t>(mask & ~probe.shows) * plane_size_ + probe.to];
      if (rest == kUnreachable) continue;
      const std::uint32_t value = rest + (probe.to == probe.from ? std::min(free_units, contact_units) : free_units);
      if (value < cost[probe.from]) {
        cost[probe.from] = value;
        seeds.emplace_back(value, probe.from);
      }
    }
    std::ranges::sort(seeds);
    // All steps cost the same, so the queue of relaxed cells is sorted by itself and merging it with the seeds is
    // Dijkstra's algorithm.
    queue.clear();
    std::size_t next_seed = 0;
    std::size_t next_queued = 0;
    while (next_seed < seeds.size() || next_queued < queue.size()) {
      const bool take_seed = next_queued == queue.size() ||
                             (next_seed < seeds.size() && seeds[next_seed].first <= queue[next_queued].first);
      const auto [value, cell] = take_seed ? seeds[next_seed++] : queue[next_queued++];
      if (value != cost[cell]) continue;
      for (const Direction d : kDirections) {
        if ((enters[cell] >> IndexOf(d) & 1) == 0) continue;
        const auto before = static_cast<std::uint32_t>(static_cast<std::int64_t>(cell) -
                                                       SignOf(d) * strides_of[static_cast<std::size_t>(AxisOf(d))]);
        if (value + free_units < cost[before]) {
          cost[before] = value + free_units;
          queue.emplace_back(cost[before], before);
        }
      }
    }
    std::uint16_t* const plane = planes + static_cast<std::size_t>(mask) * plane_size_;
    for (std::size_t i = 0; i < plane_size_; ++i) {
      plane[i] = cost[i] == kInfinite ? kUnreachable
                                      : static_cast<std::uint16_t>(std::min<std::uint32_t>(cost[i], kUnreachable - 1));
    }
  }
}

}  // namespace feeler::planner
