#include <algorithm>
#include <numeric>
#include <vector>

#include "feeler/core/worker_pool.h"
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
  const std::size_t handed_over = RunInOrder(
      episodes.size(), jobs,
      [&] {
        return [&episodes, runner = make_runner()](std::size_t index) mutable {
          return runner.Run(static_cast<std::uint64_t>(episodes[index]));
        };
      },
      [&](std::size_t index, const EpisodeRecord& record) {
        on_record(record);
        if (progress) progress(static_cast<std::int64_t>(index) + 1, static_cast<std::int64_t>(episodes.size()));
      },
      cancellation);
  return static_cast<std::int64_t>(handed_over);
}

}  // namespace feeler::workflow
