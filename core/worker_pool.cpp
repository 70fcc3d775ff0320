#include "feeler/core/worker_pool.h"

#include <exception>
#include <system_error>
#include <thread>
#include <vector>

namespace feeler {

void RunOnThreads(int threads, const std::function<void()>& work) {
  std::mutex mutex;  // guards failure
  std::exception_ptr failure;
  const auto guarded = [&] {
    try {
      work();
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> others;
    if (threads > 1) others.reserve(static_cast<std::size_t>(threads - 1));
    try {
      for (int i = 1; i < threads; ++i) others.emplace_back(guarded);
    } catch (const std::system_error&) {  // NOLINT(bugprone-empty-catch): those that run do the work
    }
    guarded();
  }  // all have stopped
  if (failure) std::rethrow_exception(failure);
}

}  // namespace feeler
