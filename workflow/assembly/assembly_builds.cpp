#include "feeler/workflow/assembly/assembly_builds.h"

#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "feeler/core/json_depth.h"
#include "feeler/core/worker_pool.h"
#include "feeler/workflow/scale/ordered_pieces.h"
#include "feeler/workflow/scale/shard.h"

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

namespace {

/// Makes workers that build the structure of a number and give its lines, a line each.
auto BuildWorkers(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                  const AssemblyOptions& options) {
  return [&] {
    return [&](std::int64_t build) {
      AssemblyOptions own = options;
      own.seed = options.seed + static_cast<std::uint64_t>(build);
      own.film = nullptr;
      std::string text;
      for (const auto& line : ToJsonLines(assembly, BuildAssembly(assembly, plan, tasks, own))) {
        text += line.dump() + "\n";
      }
      return text;
    };
  };
}

}  // namespace

void BuildAssembliesOnRanks(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                            const AssemblyOptions& options, int builds, Parallelism jobs, Ranks& ranks,
                            const std::function<void(const std::vector<std::string>& lines)>& on_lines) {
  RunPiecesInOrder(
      NumbersOfShard(0, builds, std::nullopt), jobs, &ranks, BuildWorkers(assembly, plan, tasks, options),
      [&](std::size_t, const std::string& text) {
        std::vector<std::string> lines;
        std::istringstream in(text);
        for (std::string line; std::getline(in, line);) lines.push_back(line);
        on_lines(lines);
      },
      options.cancellation);
}

void ServeAssemblies(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                     const AssemblyOptions& options, Parallelism jobs, Ranks& ranks, const std::string& identity) {
  ServePieces(ranks, identity, jobs, BuildWorkers(assembly, plan, tasks, options));
}

AssemblyRecord SummaryRecord(const std::vector<std::string>& lines) {
  AssemblyRecord record;
  for (const std::string& line : lines) {
    const auto json = ParseJsonText<nlohmann::json>(line);
    record.assembly = json.at("assembly");
    record.seed = json.at("seed");
    if (!json.contains("step")) {
      record.complete = json.at("complete");
      record.reason = json.at("reason");
      record.insertions = json.at("insertions");
      record.sim_time_s = json.at("sim_time_s");
      continue;
    }
    AssemblyStepRecord& step = record.steps.emplace_back();
    step.insertion = json.at("step");
    step.inserted = json.at("inserted");
    step.drawn_error.lateral_m = json.at("off_drawing").at("lateral_m");
    step.drawn_error.angle_rad = json.at("off_drawing").at("angle_rad");
    for (const auto& tried : json.at("attempts")) {
      InsertionAttempt& attempt = step.attempts.emplace_back();
      attempt.policy_source = tried.at("policy");
      attempt.execution.ladder.resize(tried.at("ladder").size());
    }
  }
  return record;
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
