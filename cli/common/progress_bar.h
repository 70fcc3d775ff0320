#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "feeler/core/progress.h"

namespace feeler::cli {

/// A progress bar on stderr: redrawn in place on a terminal, a line each tenth of the way elsewhere.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Update(std::int64_t done, std::int64_t total);
  /// Ends the bar's line; further updates begin a new bar.
  void Finish();
  /// A callback that updates this bar, which must outlive it.
  ProgressCallback Callback() {
    return [this](std::int64_t done, std::int64_t total) { Update(done, total); };
  }

 private:
  std::string label_;
  bool terminal_;
  bool drawn_ = false;
  std::int64_t last_tenth_ = -1;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_draw_;
};

}  // namespace feeler::cli
