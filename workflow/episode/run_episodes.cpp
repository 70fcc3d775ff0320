#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <numeric>
#include <thread>
#include <vector>

#include "feeler/workflow/episode/episode.h"

namespace feeler::workflow {

std::vector<std::int64_t> EpisodeRange(std::int64_t first, std::int64_t end) {
  std::vector<std::int64_t> episodes(static_cast<std::size_t>(std::max<std::int64_t>(0, end - first)));
  std::iota(episodes.begin(), episodes.end(), first);
  return episodes;
}

std::int64_t RunEpisodes(const std::vector<std::int64_t>& episodes, Parallelism jobs,
                         const std::function<EpisodeRunner()>& make_runner,
                         const std::function<void(const EpisodeRecord&)>& on_record, const ProgressCallback& progress,
                         const CancellationToken* cancellation) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;  // guards all below
  std::map<std::size_t, EpisodeRecord> waiting;
  std::size_t handed_over = 0;
  std::exception_ptr error;

  const auto work = [&] {
    try {
      EpisodeRunner runner = make_runner();
      while (!stop && !(cancellation != nullptr && cancellation->cancelled())) {
        const std::size_t index = next++;
        if (index >= episodes.size()) return;
        EpisodeRecord record = runner.Run(static_cast<std::uint64_t>(episodes[index]));
        const std::lock_guard lock(mutex);
        waiting.emplace(index, std::move(record));
        while (!waiting.empty() && waiting.begin()->first == handed_over) {
          on_record(waiting.begin()->second);
          waiting.erase(waiting.begin());
          ++handed_over;
        }
        if (progress) progress(static_cast<std::int64_t>(handed_over), static_cast<std::int64_t>(episodes.size()));
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!error) error = std::current_exception();
      stop = true;
    }
  };

  std::vector<std::thread> threads;
  for (int i = 1; i < jobs.threads(); ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (error) std::rethrow_exception(error);
  return static_cast<std::int64_t>(handed_over);
}

}  // namespace feeler::workflow
