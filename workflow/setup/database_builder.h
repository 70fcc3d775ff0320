#pragma once

#include <optional>
#include <string>

#include "feeler/planner/family/preprocess.h"
#include "feeler/policies/storage/database.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::workflow {

/// What a database for this task under these options is: its identity decides whether a file may be continued.
policies::DatabaseIdentity IdentityOf(const PlanningSetup& setup, const planner::PreprocessOptions& options);

struct DatabaseBuild {
  planner::PreprocessSummary summary;
  policies::DatabaseInfo info;
};

/// Builds or continues the database at `path` (the main job, steps 1 and 2): solves every problem of the family that
/// the file does not hold yet, one transaction each; leaves the bundle of the task beside it (bundle.h). Throws
/// InputError for a file of another task or other settings, or one that cannot be written. `shard`: what part of the
/// family the file says it holds, that of options.only.
DatabaseBuild BuildDatabase(const PlanningSetup& setup, const planner::ProblemFamily& family,
                            const planner::PreprocessOptions& options, const std::string& path,
                            const std::optional<policies::DatabaseShard>& shard = std::nullopt);

struct DatabaseVerification {
  std::int64_t problems = 0;
  std::int64_t policies = 0;
  std::int64_t hypotheses = 0;      ///< replayed
  double largest_cost_error = 0.0;  ///< between stored and replayed expected cost
  std::string first_fault;          ///< empty if all is well
  std::int64_t faults = 0;
};

/// Replays every stored policy under every hypothesis of its start belief against the contact map. Throws InputError if
/// the file is damaged or was made for another task.
DatabaseVerification VerifyDatabase(const PlanningSetup& setup, policies::Database& database, Parallelism jobs,
                                    const ProgressCallback& progress, const CancellationToken* cancellation);

}  // namespace feeler::workflow
