#include "feeler/planner/noise/noisy_outcomes.h"

#include <algorithm>
#include <cstddef>

namespace feeler::planner {

const NoisyMove& NoisyMoves::Of(int cells, int room) {
  room = std::min(room, cells);
  const auto [at, added] = moves_.try_emplace({cells, room});
  NoisyMove& move = at->second;
  if (!added) return move;
  const auto places = static_cast<std::size_t>(room) + 1;
  // Probability of being `k` cells on and still under way, before each of the steps.
  std::vector<double> under_way(places, 0.0);
  std::vector<double> next(places, 0.0);
  std::vector<double> stopped(places, 0.0);
  under_way[0] = 1.0;
  for (int step = 0; step < cells; ++step) {
    std::ranges::fill(next, 0.0);
    for (std::size_t k = 0; k < places; ++k) {
      const double here = under_way[k];
      if (here == 0.0) continue;
      const bool blocked = static_cast<int>(k) == room;  // room < cells here: else no step is left when it is used up
      const double contact = blocked ? 1.0 - noise_.missed_contact : noise_.false_stop;
      const double stays = blocked ? noise_.missed_contact : noise_.slip;
      stopped[k] += here * contact;
      next[k] += here * stays;
      if (!blocked) next[k + 1] += here * (1.0 - noise_.false_stop - noise_.slip);
      move.contact += here * contact;
      move.steps += here * (1.0 - contact);
    }
    under_way.swap(next);
  }
  for (std::size_t k = 0; k < places; ++k) {
    if (under_way[k] > 0.0) move.outcomes.push_back({{static_cast<int>(k), false}, under_way[k]});
    if (stopped[k] > 0.0) move.outcomes.push_back({{static_cast<int>(k), true}, stopped[k]});
  }
  return move;
}

}  // namespace feeler::planner
