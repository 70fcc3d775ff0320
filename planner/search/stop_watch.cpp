#include "feeler/planner/search/stop_watch.h"

#include <cmath>

namespace feeler::planner {

StopWatch::StopWatch(const SolverOptions& options)
    : options_(options), start_(std::chrono::steady_clock::now()), cpu_start_s_(ThreadCpuSeconds()) {}

double StopWatch::wall_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

std::optional<SolverStatus> StopWatch::Stop(std::int64_t expansions) {
  ++calls_;
  if (options_.cancellation != nullptr && options_.cancellation->cancelled()) return SolverStatus::kCancelled;
  return Spent(share_, expansions);
}

std::optional<SolverStatus> StopWatch::Spent(double share, std::int64_t expansions) const {
  const double most = share * static_cast<double>(options_.expansion_limit);
  if (static_cast<double>(expansions_before_ + expansions) >= most) return SolverStatus::kExpansionLimit;
  if ((calls_ & 63) != 0) return std::nullopt;
  if (wall_s() >= share * options_.time_limit_s) return SolverStatus::kTimeLimit;
  if (std::isfinite(options_.cpu_limit_s) && cpu_s() >= share * options_.cpu_limit_s) return SolverStatus::kTimeLimit;
  return std::nullopt;
}

bool StopWatch::RowDue() {
  if (!options_.on_bounds || (calls_ & 15) != 0) return false;
  const double now_s = wall_s();
  if (now_s < next_row_s_) return false;
  next_row_s_ = now_s < 0.1 ? 0.1 : now_s * 1.25;
  return true;
}

}  // namespace feeler::planner
