#pragma once

#include <cstddef>
#include <functional>
#include <utility>

namespace feeler::planner {

/// Thrown out of work that takes long in one piece (a file read, a belief expanded, a sweep) where it is to stop.
struct Interrupted {};

/// Asks `stop` once in a while, however the work is cut up: each call says how much has been done since the last one,
/// in steps of some nanoseconds. Throws Interrupted where `stop` says so. Without `stop` it does nothing.
class Pulse {
 public:
  Pulse() = default;
  explicit Pulse(std::function<bool()> stop) : stop_(std::move(stop)) {}

  void operator()(std::size_t work) {
    done_ += work;
    if (done_ < kStride) return;
    done_ = 0;
    if (stop_ && stop_()) throw Interrupted();
  }

 private:
  /// Some milliseconds.
  static constexpr std::size_t kStride = std::size_t{1} << 20;
  std::function<bool()> stop_;
  std::size_t done_ = 0;
};

}  // namespace feeler::planner
