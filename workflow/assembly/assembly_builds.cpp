#include "feeler/workflow/assembly/assembly_builds.h"

#include <algorithm>
#include <mutex>

#include "feeler/core/worker_pool.h"

namespace feeler::workflow {

void BuildAssemblies(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                     const AssemblyOptions& options, int builds, Parallelism jobs,
                     const std::function<void(const AssemblyRecord&)>& on_record, const ProgressCallback& progress) {
  std::mutex mutex;  // guards inserted
  std::int64_t inserted = 0;
  const std::int64_t total = static_cast<std::int64_t>(assembly.insertions.size()) * builds;
  RunInOrder(
      static_cast<std::size_t>(std::max(0, builds)), jobs,
      [&] {
        return [&](std::size_t index) {
          AssemblyOptions own = options;
          own.seed = options.seed + index;
          if (index > 0) own.film = nullptr;
          own.progress = [&](std::int64_t, std::int64_t) {
            const std::lock_guard lock(mutex);
            if (progress) progress(++inserted, total);
          };
          return BuildAssembly(assembly, plan, tasks, own);
        };
      },
      [&](std::size_t, const AssemblyRecord& record) { on_record(record); }, options.cancellation);
}

AssemblySummary Summarize(const std::vector<AssemblyRecord>& records) {
  AssemblySummary summary;
  for (const AssemblyRecord& record : records) {
    ++summary.builds;
    if (record.complete) {
      ++summary.complete;
      summary.complete_sim_time_s.push_back(record.sim_time_s);
    }
    for (const AssemblyStepRecord& step : record.steps) {
      ++summary.insertions;
      if (step.inserted) ++summary.inserted;
      if (step.inserted && step.attempts.size() == 1) ++summary.first_attempt;
      bool ladder = step.attempts.size() > 1;
      for (const InsertionAttempt& attempt : step.attempts) {
        ++summary.policies[attempt.policy_source];
        ladder = ladder || !attempt.execution.ladder.empty();
      }
      if (ladder) ++summary.ladder_used;
      summary.largest_lateral_m = std::max(summary.largest_lateral_m, step.drawn_error.lateral_m);
      summary.largest_angle_rad = std::max(summary.largest_angle_rad, step.drawn_error.angle_rad);
    }
  }
  return summary;
}

}  // namespace feeler::workflow
