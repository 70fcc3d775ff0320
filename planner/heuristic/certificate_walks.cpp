#include "planner/heuristic/certificate_walks.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "core/direction.h"

namespace feeler::planner {

void FillCertificates(const CertificateWalks& walks, int bits, std::uint16_t* planes) {
  constexpr std::uint32_t kInfinite = ~std::uint32_t{0};
  const std::size_t cells = walks.enters.size();
  // By number of others: a probe leads to a smaller mask, a step that shows nothing stays in its mask.
  std::vector<std::uint32_t> masks(std::size_t{1} << bits);
  for (std::uint32_t m = 0; m < masks.size(); ++m) masks[m] = m;
  std::ranges::stable_sort(masks, {}, [](std::uint32_t m) { return std::popcount(m); });
  std::vector<std::uint32_t> cost(cells);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> seeds;  // cost, cell
  std::vector<std::pair<std::uint32_t, std::uint32_t>> queue;
  std::fill(planes, planes + cells, std::uint16_t{0});
  for (const std::uint32_t mask : masks) {
    if (mask == 0) continue;
    std::ranges::fill(cost, kInfinite);
    seeds.clear();
    for (const CertificateWalks::Probe& probe : walks.probes) {
      if ((probe.shows & mask) == 0) continue;
      const std::uint16_t rest = planes[(mask & ~probe.shows) * cells + probe.to];
      if (rest == kNoCertificate) continue;
      const std::uint32_t value = rest + probe.cost;
      if (value >= cost[probe.from]) continue;
      cost[probe.from] = value;
      seeds.emplace_back(value, probe.from);
    }
    std::ranges::sort(seeds);
    // Free steps cost the same, so relaxed cells queue up in order of cost: merging the queue with the seeds is
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
        if ((walks.enters[cell] >> IndexOf(d) & 1) == 0) continue;
        const std::int64_t stride = walks.strides[static_cast<std::size_t>(AxisOf(d))];
        const auto before = static_cast<std::uint32_t>(static_cast<std::int64_t>(cell) - SignOf(d) * stride);
        if (value + walks.step_cost >= cost[before]) continue;
        cost[before] = value + walks.step_cost;
        queue.emplace_back(cost[before], before);
      }
    }
    std::uint16_t* const plane = planes + mask * cells;
    for (std::size_t i = 0; i < cells; ++i) {
      plane[i] = cost[i] == kInfinite
                     ? kNoCertificate
                     : static_cast<std::uint16_t>(std::min<std::uint32_t>(cost[i], kNoCertificate - 1));
    }
  }
}

}  // namespace feeler::planner
