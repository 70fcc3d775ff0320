// Laws (core/worker_pool.h), over 1 to 8 threads and work of uneven length:
//   - every index is worked once and its result is handed over in order, one call at a time;
//   - a worker is made by the thread that uses it and is never used by another;
//   - the first exception comes out after all threads have stopped; nothing behind the index that failed is handed
//   over;
//   - after a cancellation what was begun is handed over, without a gap;
//   - where the system gives no threads (a limit of its address space), the work is done all the same.
#include "feeler/core/worker_pool.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace feeler {
namespace {

/// Uneven: late indices are often done before early ones.
void WorkUnevenly(std::size_t index) {
  std::this_thread::sleep_for(std::chrono::microseconds(index % 7 == 0 ? 800 : 50));
}

TEST(WorkerPool, EachIndexOnceAndInOrder) {
  for (const int threads : {1, 2, 3, 8}) {
    std::vector<std::size_t> received;
    std::atomic<int> inside{0};
    const std::size_t handed_over = RunInOrder(
        200, Parallelism(threads),
        [] {
          return [](std::size_t index) {
            WorkUnevenly(index);
            return index * index;
          };
        },
        [&](std::size_t index, std::size_t result) {
          EXPECT_EQ(++inside, 1);
          EXPECT_EQ(result, index * index);
          received.push_back(index);
          --inside;
        });
    std::vector<std::size_t> all(200);
    std::iota(all.begin(), all.end(), std::size_t{0});
    EXPECT_EQ(received, all) << threads;
    EXPECT_EQ(handed_over, 200U);
  }
}

TEST(WorkerPool, WorkerBelongsToItsThread) {
  struct Worker {
    Worker() = default;
    Worker(Worker&&) = default;
    Worker(const Worker&) = delete;
    std::thread::id made_by = std::this_thread::get_id();
  };
  std::atomic<int> made{0};
  RunInOrder(
      100, Parallelism(4),
      [&] {
        ++made;
        return [worker = Worker()](std::size_t index) {
          WorkUnevenly(index);
          return worker.made_by == std::this_thread::get_id();
        };
      },
      [](std::size_t, bool own) { EXPECT_TRUE(own); });
  EXPECT_GE(made, 1);
  EXPECT_LE(made, 4);
}

TEST(WorkerPool, NoMoreWorkersThanIndices) {
  std::atomic<int> made{0};
  EXPECT_EQ(RunInOrder(
                2, Parallelism(8),
                [&] {
                  ++made;
                  return [](std::size_t index) { return index; };
                },
                [](std::size_t, std::size_t) {}),
            2U);
  EXPECT_LE(made, 2);
}

TEST(WorkerPool, FirstExceptionAfterAllHaveStopped) {
  for (const int threads : {1, 2, 8}) {
    std::atomic<int> working{0};
    std::vector<std::size_t> received;
    const auto run = [&] {
      RunInOrder(
          1000, Parallelism(threads),
          [&] {
            return [&](std::size_t index) {
              ++working;
              WorkUnevenly(index);
              --working;
              if (index == 20) throw std::runtime_error("index 20");
              return index;
            };
          },
          [&](std::size_t index, std::size_t) { received.push_back(index); });
    };
    try {
      run();
      FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "index 20");
    }
    EXPECT_EQ(working, 0);
    ASSERT_LE(received.size(), 20U);
    for (std::size_t i = 0; i < received.size(); ++i) EXPECT_EQ(received[i], i);
  }
}

TEST(WorkerPool, NothingIsHandedOverBehindAReceiverThatFailed) {
  for (const int threads : {1, 4}) {
    std::vector<std::size_t> received;
    EXPECT_THROW(RunInOrder(
                     200, Parallelism(threads),
                     [] {
                       return [](std::size_t index) {
                         WorkUnevenly(index);
                         return index;
                       };
                     },
                     [&](std::size_t index, std::size_t) {
                       received.push_back(index);
                       if (index == 5) throw std::runtime_error("full");
                     }),
                 std::runtime_error);
    EXPECT_EQ(received, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
  }
}

TEST(WorkerPool, AWorkerThatCannotBeMadeIsAnError) {
  const auto none = [](std::size_t) { return 0; };
  EXPECT_THROW(RunInOrder(
                   5, Parallelism(3), [&]() -> decltype(none) { throw std::runtime_error("no robot"); },
                   [](std::size_t, int) {}),
               std::runtime_error);
}

TEST(WorkerPool, CancellationLeavesNoGap) {
  for (const int threads : {1, 3}) {
    CancellationToken token;
    std::atomic<std::size_t> begun{0};
    std::vector<std::size_t> received;
    const std::size_t handed_over = RunInOrder(
        500, Parallelism(threads),
        [&] {
          return [&](std::size_t index) {
            ++begun;
            WorkUnevenly(index);
            if (index == 40) token.Cancel();
            return index;
          };
        },
        [&](std::size_t index, std::size_t) { received.push_back(index); }, &token);
    EXPECT_EQ(handed_over, begun);
    EXPECT_GE(handed_over, 41U);
    EXPECT_LT(handed_over, 60U);
    for (std::size_t i = 0; i < received.size(); ++i) EXPECT_EQ(received[i], i);
  }
}

TEST(WorkerPool, ParallelForVisitsAllAndTellsProgress) {
  std::vector<int> visits(300, 0);
  std::int64_t last = 0;
  EXPECT_TRUE(ParallelFor(
      visits.size(), Parallelism(4), [&](std::size_t i) { ++visits[i]; },
      [&](std::int64_t done, std::int64_t total) {
        EXPECT_EQ(done, last + 1);
        EXPECT_EQ(total, 300);
        last = done;
      }));
  EXPECT_EQ(last, 300);
  EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), 300);
  CancellationToken token;
  token.Cancel();
  EXPECT_FALSE(ParallelFor(
      3, Parallelism(2), [](std::size_t) { ADD_FAILURE(); }, {}, &token));
  EXPECT_TRUE(ParallelFor(0, Parallelism(2), [](std::size_t) { ADD_FAILURE(); }));
}

/// In a process of its own, whose address space has no room for further stacks.
TEST(WorkerPool, WithoutThreadsTheCallerDoesTheWork) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer needs the address space";
#endif
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const rlimit none{.rlim_cur = std::size_t{1} << 20, .rlim_max = std::size_t{1} << 20};
    if (setrlimit(RLIMIT_AS, &none) != 0) _exit(2);
    std::vector<std::jthread> parked;  // on the stacks that earlier threads left behind
    parked.reserve(64);
    bool refused = false;
    try {
      while (parked.size() < 64) {
        parked.emplace_back([](const std::stop_token& stop) {
          while (!stop.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        });
      }
    } catch (const std::system_error&) {
      refused = true;
    }
    if (!refused) _exit(3);
    std::size_t sum = 0;
    std::mutex mutex;
    const bool all = ParallelFor(100, Parallelism(16), [&](std::size_t i) {
      const std::lock_guard lock(mutex);
      sum += i;
    });
    _exit(all && sum == 4950 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace feeler
