#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <type_traits>
#include <utility>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"

/// The one loop by which work is spread over threads. Laws, whatever the number of threads:
///   - every index of 0..count-1 is worked at most once, and exactly once where nothing fails or is cancelled;
///   - results are handed over in the order of the indices, one at a time, without a gap;
///   - the first exception, of a worker or of what receives the results, is rethrown after every thread has stopped;
///   what
///     stands before the index that failed may still be handed over, nothing behind it is;
///   - after a cancellation no further index begins; those that have begun are finished and handed over;
///   - a thread that cannot be started means fewer threads; the calling thread always works.
namespace feeler {

/// Runs `work` on the calling thread and on threads - 1 more, or as many of them as can be started, and waits for all.
/// Rethrows the first exception; `work` itself makes the others stop.
void RunOnThreads(int threads, const std::function<void()>& work);

/// Works the indices 0..count-1 on at most jobs.threads() threads: each makes one worker with make_worker() and calls
/// worker(index) until no index is left.
template <class MakeWorker>
void RunWorkers(std::size_t count, Parallelism jobs, const MakeWorker& make_worker,
                const CancellationToken* cancellation = nullptr) {
  if (count == 0) return;
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  const auto threads = static_cast<int>(std::min(count, static_cast<std::size_t>(jobs.threads())));
  RunOnThreads(threads, [&] {
    try {
      auto worker = make_worker();
      while (!failed && !(cancellation != nullptr && cancellation->cancelled())) {
        const std::size_t index = next++;
        if (index >= count) return;
        worker(index);
      }
    } catch (...) {
      failed = true;
      throw;
    }
  });
}

namespace worker_pool_internal {

/// Results that came before their turn, and what receives them.
template <class Result, class HandOver>
class InOrder {
 public:
  explicit InOrder(HandOver& hand_over) : hand_over_(hand_over) {}

  void Put(std::size_t index, Result result) {
    const std::lock_guard lock(mutex_);
    waiting_.emplace(index, std::move(result));
    while (!broken_ && !waiting_.empty() && waiting_.begin()->first == handed_over_) {
      auto turn = waiting_.extract(waiting_.begin());
      broken_ = true;  // unless it is received
      hand_over_(turn.key(), std::move(turn.mapped()));
      broken_ = false;
      ++handed_over_;
    }
  }
  std::size_t handed_over() const { return handed_over_; }

 private:
  HandOver& hand_over_;
  std::mutex mutex_;  // guards all below
  std::map<std::size_t, Result> waiting_;
  std::size_t handed_over_ = 0;
  bool broken_ = false;
};

}  // namespace worker_pool_internal

/// Works the indices 0..count-1 on at most jobs.threads() threads. make_worker() makes the worker of a thread, on that
/// thread: a callable index -> result, with what only one thread may use. hand_over(index, result) receives the
/// results in order. Returns how many were handed over: fewer than count only after a cancellation.
template <class MakeWorker, class HandOver>
std::size_t RunInOrder(std::size_t count, Parallelism jobs, const MakeWorker& make_worker, HandOver hand_over,
                       const CancellationToken* cancellation = nullptr) {
  using Worker = std::invoke_result_t<const MakeWorker&>;
  using Result = std::invoke_result_t<Worker&, std::size_t>;
  worker_pool_internal::InOrder<Result, HandOver> results(hand_over);
  RunWorkers(
      count, jobs,
      [&] {
        return [worker = make_worker(), &results](std::size_t index) mutable { results.Put(index, worker(index)); };
      },
      cancellation);
  return results.handed_over();
}

/// visit(index) for the indices 0..count-1, in any order, on at most jobs.threads() threads; what indices write must be
/// independent. Progress is told after each. Returns false if it was cancelled before the last had begun.
template <class Visit>
bool ParallelFor(std::size_t count, Parallelism jobs, const Visit& visit, const ProgressCallback& progress = {},
                 const CancellationToken* cancellation = nullptr) {
  std::mutex mutex;  // guards done
  std::size_t done = 0;
  RunWorkers(
      count, jobs,
      [&] {
        return [&](std::size_t index) {
          visit(index);
          const std::lock_guard lock(mutex);
          ++done;
          if (progress) progress(static_cast<std::int64_t>(done), static_cast<std::int64_t>(count));
        };
      },
      cancellation);
  return done == count;
}

}  // namespace feeler
