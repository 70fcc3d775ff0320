#include "planner/preprocess/preprocess.h"

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace feeler::planner {

PreprocessSummary Preprocess(const Task& task, std::shared_ptr<const ContactMap> map, const ProblemFamily& family,
                             const PreprocessOptions& options, PolicySink& sink) {
  const auto begin = std::chrono::steady_clock::now();
  PreprocessSummary summary;
  summary.problems = static_cast<std::int64_t>(family.problems.size());
  if (family.problems.empty()) return summary;
  SolverOptions solver = options.solver;
  solver.on_bounds = nullptr;
  solver.cancellation = options.cancellation;
  Validate(solver);
  const std::vector<std::size_t> order = OrderOf(family, options.order, options.seed);
  const auto tables = BuildPlanningTables(MakeCuboidProblem(task, map, family.problems.front()), solver);
  std::mutex mutex;
  std::size_t next = 0;
  std::int64_t done = 0;
  const auto work = [&] {
    while (true) {
      Extents extents;
      {
        const std::lock_guard lock(mutex);
        if (next == order.size() || (options.cancellation != nullptr && options.cancellation->cancelled())) return;
        extents = family.problems[order[next++]];
        if (sink.Done(extents)) {
          ++summary.skipped;
          if (options.progress) options.progress(++done, summary.problems);
          continue;
        }
      }
      const Problem problem = MakeCuboidProblem(task, map, extents);
      const SolverResult result = Solve(problem, solver, tables);
      const std::lock_guard lock(mutex);
      if (result.status == SolverStatus::kCancelled) return;
      sink.Store(extents, problem, result);
      ++(result.complete() ? summary.complete : summary.failed);
      summary.cpu_s += result.cpu_s;
      if (options.progress) options.progress(++done, summary.problems);
    }
  };
  std::vector<std::jthread> threads;
  for (int i = 1; i < options.jobs.threads(); ++i) threads.emplace_back(work);
  work();
  threads.clear();
  summary.cancelled = options.cancellation != nullptr && options.cancellation->cancelled();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

}  // namespace feeler::planner
