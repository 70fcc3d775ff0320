#include "feeler/workflow/scale/job_model.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <numeric>
#include <queue>
#include <utility>

namespace feeler::workflow {
namespace {

constexpr std::size_t kPiecesForQueues = 16;

/// A piece is done, or a rank becomes ready for its first.
struct Event {
  double at_s = 0.0;
  int rank = 0;
  bool result = false;
  bool operator>(const Event& other) const { return std::pair(at_s, rank) > std::pair(other.at_s, other.rank); }
};

}  // namespace

JobForecast Simulate(const JobModel& model, int ranks) {
  JobForecast forecast;
  forecast.ranks = ranks;
  forecast.work_s = std::accumulate(model.piece_s.begin(), model.piece_s.end(), 0.0);
  if (!model.piece_s.empty()) forecast.longest_s = *std::ranges::max_element(model.piece_s);
  const bool queues = model.piece_s.size() >= kPiecesForQueues * static_cast<std::size_t>(ranks);

  std::priority_queue<Event, std::vector<Event>, std::greater<>> events;
  std::vector<std::queue<double>> at_hand(static_cast<std::size_t>(ranks));
  std::size_t next = 0;
  const auto fetch = [&](int rank) {
    if (next < model.piece_s.size()) at_hand[static_cast<std::size_t>(rank)].push(model.piece_s[next++]);
  };
  const auto begin = [&](int rank, double now_s) {
    auto& own = at_hand[static_cast<std::size_t>(rank)];
    if (own.empty()) return;
    events.push({now_s + own.front(), rank, true});
    own.pop();
  };
  for (int rank = 0; rank < ranks; ++rank) fetch(rank);
  for (int rank = 1; queues && rank < ranks; ++rank) fetch(rank);
  for (int rank = 0; rank < ranks; ++rank) begin(rank, model.start_s);

  double committed_s = 0.0;  // when rank 0 is through with what has come
  forecast.wall_s = model.start_s;
  while (!events.empty()) {
    const Event event = events.top();
    events.pop();
    const bool waits = at_hand[static_cast<std::size_t>(event.rank)].empty();
    fetch(event.rank);
    committed_s = std::max(committed_s, event.at_s) + model.commit_s;
    forecast.committing_s += model.commit_s;
    // A rank with nothing at hand gets its next piece when its result has been taken in.
    const double next_s = waits ? committed_s + (event.rank > 0 ? model.message_s : 0.0) : event.at_s;
    begin(event.rank, next_s);
    forecast.wall_s = std::max(forecast.wall_s, committed_s);
  }
  if (forecast.wall_s > 0.0) forecast.efficiency = forecast.work_s / (forecast.wall_s * ranks);
  return forecast;
}

}  // namespace feeler::workflow
