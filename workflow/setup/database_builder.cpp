#include "feeler/workflow/setup/database_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/orientation_lattice.h"
#include "feeler/core/worker_pool.h"
#include "feeler/policies/storage/database_sink.h"
#include "feeler/policies/storage/verify.h"
#include "feeler/version.h"
#include "feeler/workflow/setup/bundle.h"

namespace feeler::workflow {
namespace {

planner::FamilyTraits TraitsOf(const PlanningSetup& setup) {
  return {.orientations = LatticeOrientations(setup.task()) > 1, .cells_per_axis = !setup.task().cost.one_per_cell()};
}

/// Null where there is no limit: JSON has no infinity.
nlohmann::json Limit(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

}  // namespace

policies::DatabaseIdentity IdentityOf(const PlanningSetup& setup, const planner::PreprocessOptions& options) {
  const planner::SolverOptions solver = planner::WithFamilyBudget(options.solver, TraitsOf(setup));
  nlohmann::json settings = {
      {"solver", planner::ToString(solver.solver)},
      {"heuristic", planner::ToString(solver.heuristic)},
      {"canonical_translation", solver.canonical_translation},
      {"time_limit_s", Limit(solver.time_limit_s)},
      {"expansion_limit", solver.expansion_limit},
      {"seed", solver.seed},
  };
  const std::int64_t small_limit =
      planner::WithFamilyBudget(options.solver, TraitsOf(setup), planner::kSmallOrientedHypotheses).expansion_limit;
  if (small_limit != solver.expansion_limit) {
    settings["expansion_limit_small"] = {{"hypotheses", planner::kSmallOrientedHypotheses},
                                         {"expansions", small_limit}};
  }
  if (solver.solver == planner::SolverKind::kCertified) {
    settings["gap"] = solver.gap;
  } else {
    settings["epsilon"] = solver.epsilon;
  }
  if (solver.solver == planner::SolverKind::kERtdpBel) {
    settings["experience"] = planner::ToString(options.experience);
    settings["order"] = options.order == planner::ProblemOrder::kUncertainty ? "uncertainty" : "random";
    settings["order_seed"] = options.seed;
  }
  if (setup.cost_kind == CostKind::kTime) settings["cost"] = ToString(setup.cost_kind);
  if (!setup.prior_deviation.empty()) settings[kPriorSetting] = setup.prior_deviation;
  policies::DatabaseIdentity identity;
  identity.task = setup.task().name;
  identity.axes = planner::AxesOf(setup.task());
  identity.fingerprint = setup.fingerprint;
  identity.opening = env::ToString(setup.opening);
  identity.goal = ToString(setup.task().goal);
  identity.cost = setup.task().cost;
  identity.settings = settings.dump();
  identity.created_by = FEELER_VERSION;
  return identity;
}

DatabaseBuild BuildDatabase(const PlanningSetup& setup, const planner::ProblemFamily& family,
                            const planner::PreprocessOptions& options, const std::string& path,
                            const std::optional<policies::DatabaseShard>& shard) {
  policies::DatabaseIdentity identity = IdentityOf(setup, options);
  identity.shard = shard;
  policies::Database database = policies::Database::OpenOrCreate(path, identity);
  planner::PreprocessOptions of_setup = options;
  of_setup.prior_deviation = setup.prior_deviation;
  policies::DatabaseSink sink(database, options.solver);
  DatabaseBuild build;
  build.summary = planner::Preprocess(setup.task(), setup.map, family, of_setup, sink);
  build.info = database.Info();
  KeepBundle(setup, path);
  return build;
}

DatabaseVerification VerifyDatabase(const PlanningSetup& setup, policies::Database& database, Parallelism jobs,
                                    const ProgressCallback& progress, const CancellationToken* cancellation) {
  database.RequireFingerprint(setup.task().name, setup.fingerprint);
  database.Verify();

  const std::vector<policies::StoredProblem> problems = database.List();
  DatabaseVerification result;
  result.problems = static_cast<std::int64_t>(problems.size());
  std::vector<std::string> faults(problems.size());
  std::mutex mutex;  // guards result

  const auto verify = [&](std::size_t i) {
    const auto stored = database.Get(problems[i].extents);
    double error = 0.0;
    int hypotheses = 0;
    if (stored && stored->policy) {
      const planner::Problem problem = setup.ProblemOf(stored->extents);
      const policies::RowVerification row = policies::VerifyRow(*stored, problem);
      error = std::abs(row.replayed_cost - stored->expected_cost);
      hypotheses = static_cast<int>(problem.hypotheses.size());
      if (!row.valid()) faults[i] = planner::ToString(stored->extents, setup.task()) + ": " + row.fault;
    }
    const std::lock_guard lock(mutex);
    if (hypotheses > 0) ++result.policies;
    result.hypotheses += hypotheses;
    result.largest_cost_error = std::max(result.largest_cost_error, error);
  };
  ParallelFor(problems.size(), jobs, verify, progress, cancellation);
  for (const std::string& fault : faults) {
    if (fault.empty()) continue;
    if (result.first_fault.empty()) result.first_fault = fault;
    ++result.faults;
  }
  return result;
}

}  // namespace feeler::workflow
