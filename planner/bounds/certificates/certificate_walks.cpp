#include "feeler/planner/bounds/certificates/certificate_walks.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "feeler/core/direction.h"
#include "feeler/planner/bounds/certificates/equal_steps.h"

namespace feeler::planner {
namespace {

constexpr std::uint32_t kNoWalk = ~std::uint32_t{0};

/// Dijkstra's algorithm over whole numbers: what is queued at a cost comes out in order of cost.
class BucketQueue {
 public:
  void Push(std::uint32_t cost, std::uint32_t item) {
    if (cost >= buckets_.size()) buckets_.resize(cost + std::size_t{1});
    buckets_[cost].push_back(item);
  }
  /// Calls f(cost, item); f may push at the cost at hand and above.
  template <class F>
  void Drain(F f) {
    for (std::uint32_t cost = 0; cost < buckets_.size(); ++cost) {
      for (std::size_t i = 0; i < buckets_[cost].size(); ++i) f(cost, buckets_[cost][i]);
      buckets_[cost].clear();
    }
  }

 private:
  std::vector<std::vector<std::uint32_t>> buckets_;
};

/// One mask where setting out costs something. States: at rest in a cell, and in motion through it in direction d. A
/// free step that shows something leads to the table of the others left, which counts from rest: what setting out again
/// would cost is given back, so that going on is as cheap as it is.
void FillByMotions(const CertificateWalks& walks, std::uint32_t mask, std::uint16_t* planes,
                   std::vector<std::uint32_t>& cost, BucketQueue& queue) {
  const std::size_t cells = walks.enters.size();
  constexpr std::uint32_t kAtRest = kDirectionCount;
  cost.assign(cells * (kDirectionCount + 1), kNoWalk);
  const auto relax = [&](std::uint32_t kind, std::uint32_t cell, std::uint32_t value) {
    const auto state = static_cast<std::uint32_t>(kind * cells + cell);
    value = std::min<std::uint32_t>(value, kNoCertificate - 1);
    if (value >= cost[state]) return;
    cost[state] = value;
    queue.Push(value, state);
  };
  for (const CertificateWalks::Probe& probe : walks.probes) {
    if ((probe.shows & mask) == 0) continue;
    const std::uint32_t rest = planes[(mask & ~probe.shows) * cells + probe.to];
    if (rest == kNoCertificate) continue;
    const std::uint32_t refund = probe.contact ? 0 : std::min(rest, walks.start_cost);
    relax(static_cast<std::uint32_t>(IndexOf(probe.direction)), probe.from, probe.cost + rest - refund);
  }
  queue.Drain([&](std::uint32_t value, std::uint32_t state) {
    if (value != cost[state]) return;
    const auto kind = static_cast<std::uint32_t>(state / cells);
    const auto cell = static_cast<std::uint32_t>(state % cells);
    if (kind != kAtRest) relax(kAtRest, cell, value + walks.start_cost);
    for (const Direction d : kDirections) {
      const auto index = static_cast<std::uint32_t>(IndexOf(d));
      if ((kind != kAtRest && kind != index) || (walks.enters[cell] >> index & 1) == 0) continue;
      const std::int64_t stride = walks.strides[static_cast<std::size_t>(AxisOf(d))];
      const auto before = static_cast<std::uint32_t>(static_cast<std::int64_t>(cell) - SignOf(d) * stride);
      relax(index, before, value + walks.step_cost);
    }
  });
  std::uint16_t* const plane = planes + mask * cells;
  const std::uint32_t* const at_rest = &cost[kAtRest * cells];
  for (std::size_t i = 0; i < cells; ++i) {
    plane[i] = static_cast<std::uint16_t>(std::min<std::uint32_t>(at_rest[i], kNoCertificate));
  }
}

}  // namespace

void FillCertificates(const CertificateWalks& walks, int bits, std::uint16_t* planes) {
  const std::size_t cells = walks.enters.size();
  BucketQueue buckets;
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
    if (walks.start_cost > 0) {
      FillByMotions(walks, mask, planes, cost, buckets);
      continue;
    }
    std::ranges::fill(cost, kNoWalk);
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
    SpreadByEqualSteps(seeds, walks.step_cost, cost, queue, [&](std::uint32_t cell, auto relax) {
      for (const Direction d : kDirections) {
        if ((walks.enters[cell] >> IndexOf(d) & 1) == 0) continue;
        const std::int64_t stride = walks.strides[static_cast<std::size_t>(AxisOf(d))];
        relax(static_cast<std::uint32_t>(static_cast<std::int64_t>(cell) - SignOf(d) * stride));
      }
    });
    std::uint16_t* const plane = planes + mask * cells;
    for (std::size_t i = 0; i < cells; ++i) {
      plane[i] = cost[i] == kNoWalk ? kNoCertificate
                                    : static_cast<std::uint16_t>(std::min<std::uint32_t>(cost[i], kNoCertificate - 1));
    }
  }
}

}  // namespace feeler::planner
