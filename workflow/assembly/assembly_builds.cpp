#include "feeler/workflow/assembly/assembly_builds.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

namespace feeler::workflow {

void BuildAssemblies(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                     const AssemblyOptions& options, int builds, Parallelism jobs,
                     const std::function<void(const AssemblyRecord&)>& on_record, const ProgressCallback& progress) {
  std::atomic<int> next{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;  // guards all below
  std::map<int, AssemblyRecord> waiting;
  int handed_over = 0;
  std::int64_t inserted = 0;
  std::exception_ptr error;
  const std::int64_t total = static_cast<std::int64_t>(assembly.insertions.size()) * builds;

  const auto work = [&] {
    try {
      for (int index = next++; index < builds && !stop; index = next++) {
        if (options.cancellation != nullptr && options.cancellation->cancelled()) return;
        AssemblyOptions own = options;
        own.seed = options.seed + static_cast<std::uint64_t>(index);
        if (index > 0) own.film = nullptr;
        own.progress = [&](std::int64_t, std::int64_t) {
          const std::lock_guard lock(mutex);
          if (progress) progress(++inserted, total);
        };
        AssemblyRecord record = BuildAssembly(assembly, plan, tasks, own);
        const std::lock_guard lock(mutex);
        waiting.emplace(index, std::move(record));
        while (!waiting.empty() && waiting.begin()->first == handed_over) {
          on_record(waiting.begin()->second);
          waiting.erase(waiting.begin());
          ++handed_over;
        }
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!error) error = std::current_exception();
      stop = true;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < std::min(jobs.threads(), builds); ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (error) std::rethrow_exception(error);
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
