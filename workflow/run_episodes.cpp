#include <atomic>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "workflow/episode.h"

namespace feeler::workflow {

std::int64_t RunEpisodes(EpisodeRange range, Parallelism jobs, const std::function<EpisodeRunner()>& make_runner,
                         const std::function<void(const EpisodeRecord&)>& on_record, const ProgressCallback& progress,
                         const CancellationToken* cancellation) {
  std::atomic<std::int64_t> next{range.first};
  std::atomic<bool> stop{false};
  std::mutex mutex;  // guards all below
  std::map<std::int64_t, EpisodeRecord> waiting;
  std::int64_t handed_over = range.first;
  std::exception_ptr error;

  const auto work = [&] {
    try {
      EpisodeRunner runner = make_runner();
      while (!stop && !(cancellation != nullptr && cancellation->cancelled())) {
        const std::int64_t episode = next++;
        if (episode >= range.end) return;
        EpisodeRecord record = runner.Run(static_cast<std::uint64_t>(episode));
        const std::lock_guard lock(mutex);
        waiting.emplace(episode, std::move(record));
        while (!waiting.empty() && waiting.begin()->first == handed_over) {
          on_record(waiting.begin()->second);
          waiting.erase(waiting.begin());
          ++handed_over;
        }
        if (progress) progress(handed_over, range.end);
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
  return handed_over - range.first;
}

}  // namespace feeler::workflow
