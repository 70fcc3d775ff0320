#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "feeler/core/clock.h"
#include "feeler/planner/options/solver_options.h"
#include "feeler/planner/options/solver_result.h"

namespace feeler::planner {

/// The stop condition of a solver, and its clocks: one for all attempts at a problem.
class StopWatch {
 public:
  explicit StopWatch(const SolverOptions& options);

  double wall_s() const;
  double cpu_s() const { return ThreadCpuSeconds() - cpu_start_s_; }
  /// Why to stop now; empty to go on. `expansions` of the attempt in work: those of earlier ones are added. Reads the
  /// clock only now and then.
  std::optional<SolverStatus> Stop(std::int64_t expansions);
  /// From now on limits hold at this share of what they are, in (0, 1]: for an attempt that must leave some to the
  /// next.
  void LimitTo(double share) { share_ = share; }
  /// The limit of which so large a share is spent; empty if there is none. As seldom as `Stop` looks at the clock.
  std::optional<SolverStatus> Spent(double share, std::int64_t expansions) const;
  /// An attempt is over, another may follow.
  void EndAttempt(std::int64_t expansions) { expansions_before_ += expansions; }
  std::int64_t expansions_before() const { return expansions_before_; }
  /// True when a row of the bounds table is due: at first, then at growing intervals of time.
  bool RowDue();

 private:
  const SolverOptions& options_;
  std::chrono::steady_clock::time_point start_;
  double cpu_start_s_ = 0.0;
  double next_row_s_ = 0.0;
  double share_ = 1.0;
  std::int64_t expansions_before_ = 0;
  int calls_ = 0;
};

}  // namespace feeler::planner
