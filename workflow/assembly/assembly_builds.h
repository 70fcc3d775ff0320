#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/workflow/assembly/assembly_build.h"
#include "feeler/workflow/scale/ranks.h"

namespace feeler::workflow {

/// Builds with the seeds options.seed, options.seed + 1, ... on several threads; hands the records to `on_record` in
/// the order of the seeds. Each is the record of BuildAssembly with that seed. A film is made of the first only.
/// Cancelled: the builds that were begun end after their present insertion and are handed over, no others begin.
void BuildAssemblies(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                     const AssemblyOptions& options, int builds, Parallelism jobs,
                     const std::function<void(const AssemblyRecord&)>& on_record, const ProgressCallback& progress);

/// The same over the ranks of a job, on rank 0; on_lines receives the record as the lines that ToJsonLines gives.
/// Throws Interrupted where other ranks did not end in time after a cancellation.
void BuildAssembliesOnRanks(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                            const AssemblyOptions& options, int builds, Parallelism jobs, Ranks& ranks,
                            const std::function<void(const std::vector<std::string>& lines)>& on_lines);
/// On another rank: builds what rank 0 asks for. Both sides give the same `identity`.
void ServeAssemblies(const Assembly& assembly, const AssemblyPlan& plan, const AssemblyTasks& tasks,
                     const AssemblyOptions& options, Parallelism jobs, Ranks& ranks, const std::string& identity);

/// What Summarize reads of a record, from its lines. Throws nlohmann::json::exception for others.
AssemblyRecord SummaryRecord(const std::vector<std::string>& lines);

/// Counts over builds.
struct AssemblySummary {
  int builds = 0;
  int complete = 0;
  int insertions = 0;  ///< begun
  int inserted = 0;
  int first_attempt = 0;                ///< insertions that succeeded at the first estimate
  int ladder_used = 0;                  ///< insertions in which a fallback was used
  std::map<std::string, int> policies;  ///< attempts by where the policy came from
  double largest_lateral_m = 0.0;       ///< of a port off where it is drawn
  double largest_angle_rad = 0.0;
  std::vector<double> complete_sim_time_s;  ///< of each complete build
};
AssemblySummary Summarize(const std::vector<AssemblyRecord>& records);

}  // namespace feeler::workflow
