#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace feeler::planner {

/// Least costs to the nearest seed where every step costs the same. `cost` holds the seeds' costs and infinity
/// elsewhere; `seeds` are (cost, cell), in any order. `for_each_before(cell, f)` calls f(before) for each cell that a
/// step leads from to `cell`. Steps cost the same, so relaxed cells queue up in order of cost: merging the queue with
/// the sorted seeds is Dijkstra's algorithm. `queue` is room to work in.
template <class ForEachBefore>
void SpreadByEqualSteps(std::vector<std::pair<std::uint32_t, std::uint32_t>>& seeds, std::uint32_t step_cost,
                        std::vector<std::uint32_t>& cost, std::vector<std::pair<std::uint32_t, std::uint32_t>>& queue,
                        ForEachBefore for_each_before) {
  std::ranges::sort(seeds);
  queue.clear();
  std::size_t next_seed = 0;
  std::size_t next_queued = 0;
  while (next_seed < seeds.size() || next_queued < queue.size()) {
    const bool take_seed =
        next_queued == queue.size() || (next_seed < seeds.size() && seeds[next_seed].first <= queue[next_queued].first);
    const auto [value, cell] = take_seed ? seeds[next_seed++] : queue[next_queued++];
    if (value != cost[cell]) continue;
    const std::uint32_t one_more = value + step_cost;
    for_each_before(cell, [&](std::uint32_t before) {
      if (one_more >= cost[before]) return;
      cost[before] = one_more;
      queue.emplace_back(one_more, before);
    });
  }
}

}  // namespace feeler::planner
