#pragma once

#include <algorithm>
#include <thread>

namespace feeler {

/// How many threads a function may use; at least one.
class Parallelism {
 public:
  Parallelism() = default;
  explicit Parallelism(int threads) : threads_(std::max(1, threads)) {}
  /// As many threads as the machine has cores.
  static Parallelism Max() { return Parallelism(static_cast<int>(std::thread::hardware_concurrency())); }
  int threads() const { return threads_; }

 private:
  int threads_ = 1;
};

}  // namespace feeler
