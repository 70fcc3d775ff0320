#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

namespace feeler {

/// Called now and then with work done and work in all; may be empty. Never called from two threads at once.
using ProgressCallback = std::function<void(std::int64_t done, std::int64_t total)>;

/// Set from a signal handler or another thread to ask long work to stop cleanly and keep what is done.
class CancellationToken {
 public:
  void Cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> cancelled_{false};
};

}  // namespace feeler
