#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "feeler/core/worker_pool.h"
#include "feeler/workflow/scale/ranks.h"

namespace feeler::workflow {

/// RunInOrder of the worker pool over the threads of this process and those of the other ranks. make_worker() makes the
/// worker of a thread: a callable number of a piece -> bytes; hand_over(index, bytes) receives them in the order of
/// `numbers`. `ranks` may be null. Laws as there; what another rank has not ended a second after a cancellation is
/// given up: then it throws Interrupted.
template <class MakeWorker, class HandOver>
std::size_t RunPiecesInOrder(const std::vector<std::int64_t>& numbers, Parallelism jobs, Ranks* ranks,
                             const MakeWorker& make_worker, const HandOver& hand_over,
                             const CancellationToken* cancellation) {
  const int near = jobs.threads();
  const int lanes = ranks != nullptr ? ranks->LanesFor(numbers.size()) : 0;
  std::atomic<int> next{0};
  return RunInOrder(
      numbers.size(), Parallelism(near + lanes),
      [&]() -> std::function<std::string(std::size_t)> {
        const int worker = next++;
        if (worker >= near) {
          return [ranks, &numbers, lane = worker - near](std::size_t index) {
            return ranks->Call(lane, std::to_string(numbers[index]));
          };
        }
        // std::function must be copyable, workers need not be.
        auto own = std::make_shared<decltype(make_worker())>(make_worker());
        return [own, &numbers](std::size_t index) { return (*own)(numbers[index]); };
      },
      hand_over, cancellation);
}

/// On another rank: answers numbers of pieces with what workers of make_worker() return.
template <class MakeWorker>
void ServePieces(Ranks& ranks, const std::string& identity, Parallelism jobs, const MakeWorker& make_worker) {
  ranks.Serve(identity, jobs.threads(), [&]() -> Ranks::Handler {
    auto own = std::make_shared<decltype(make_worker())>(make_worker());
    return [own](const std::string& request) { return (*own)(static_cast<std::int64_t>(std::stoll(request))); };
  });
}

}  // namespace feeler::workflow
