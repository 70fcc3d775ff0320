#include "workflow/database_builder.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/error.h"
#include "planner/solver/evaluate.h"

namespace feeler::workflow {
namespace {

class DatabaseSink final : public planner::PolicySink {
 public:
  DatabaseSink(policies::Database& database, const planner::PreprocessOptions& options)
      : database_(database), options_(options) {}

  bool Done(const planner::Extents& extents) override { return database_.Contains(extents); }

  std::optional<planner::Policy> Load(const planner::Extents& extents) override {
    const auto stored = database_.Get(extents);
    return stored ? stored->policy : std::nullopt;
  }

  void Store(const planner::Extents& extents, const planner::Problem& /*problem*/,
             const planner::SolverResult& result) override {
    policies::StoredProblem stored;
    stored.extents = extents;
    stored.status = planner::ToString(result.status);
    stored.solver = planner::ToString(options_.solver.solver);
    stored.epsilon =
        options_.solver.solver == planner::SolverKind::kCertified ? options_.solver.gap : options_.solver.epsilon;
    stored.expected_cost = result.expected_cost;
    stored.lower_bound = result.lower_bound;
    stored.expansions = result.expansions;
    stored.seed = options_.solver.seed;
    stored.version = FEELER_VERSION;
    stored.policy = result.policy;
    stored.cpu_s = result.cpu_s;
    stored.wall_s = result.wall_s;
    database_.Put(stored);
  }

 private:
  policies::Database& database_;
  const planner::PreprocessOptions& options_;
};

/// Null where there is no limit: JSON has no infinity.
nlohmann::json Limit(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

}  // namespace

policies::DatabaseIdentity IdentityOf(const PlanningSetup& setup, const planner::PreprocessOptions& options) {
  const planner::SolverOptions& solver = options.solver;
  nlohmann::json settings = {
      {"solver", planner::ToString(solver.solver)},
      {"heuristic", planner::ToString(solver.heuristic)},
      {"canonical_translation", solver.canonical_translation},
      {"time_limit_s", Limit(solver.time_limit_s)},
      {"expansion_limit", solver.expansion_limit},
      {"seed", solver.seed},
  };
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
  policies::DatabaseIdentity identity;
  identity.task = setup.task().name;
  identity.fingerprint = setup.fingerprint;
  identity.opening = env::ToString(setup.opening);
  identity.goal = ToString(setup.task().goal);
  identity.cost = setup.task().cost;
  identity.settings = settings.dump();
  identity.created_by = FEELER_VERSION;
  return identity;
}

void RequireWithinTask(const planner::ProblemFamily& family, const Task& task) {
  const Cell largest = LargestCuboid(task);
  for (const planner::Extents& extents : family.problems) {
    for (int axis = 0; axis < 3; ++axis) {
      if (extents[axis] >= 1 && extents[axis] <= largest[axis]) continue;
      throw InputError("problem " + planner::ToString(extents),
                       fmt::format("task {} allows 1..{} cells along {}", task.name, largest[axis], "xyz"[axis]),
                       "change the family, or the ranges in the task file");
    }
  }
}

DatabaseBuild BuildDatabase(const PlanningSetup& setup, const planner::ProblemFamily& family,
                            const planner::PreprocessOptions& options, const std::string& path) {
  policies::Database database = policies::Database::OpenOrCreate(path, IdentityOf(setup, options));
  DatabaseSink sink(database, options);
  DatabaseBuild build;
  build.summary = planner::Preprocess(setup.task(), setup.map, family, options, sink);
  build.info = database.Info();
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
  std::mutex mutex;
  std::int64_t done = 0;

  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(jobs.threads()));
  tbb::parallel_for(std::size_t{0}, problems.size(), [&](std::size_t i) {
    if (cancellation != nullptr && cancellation->cancelled()) return;
    const auto stored = database.Get(problems[i].extents);
    double error = 0.0;
    int hypotheses = 0;
    if (stored && stored->policy) {
      const planner::Problem problem = planner::MakeCuboidProblem(setup.task(), setup.map, stored->extents);
      const planner::PolicyEvaluation evaluation = planner::Evaluate(problem, *stored->policy);
      error = std::abs(evaluation.expected_cost - stored->expected_cost);
      hypotheses = static_cast<int>(problem.hypotheses.size());
      if (!evaluation.valid()) {
        faults[i] = planner::ToString(stored->extents) + ": " + evaluation.fault;
      } else if (!(error <= kCostTolerance)) {
        faults[i] = planner::ToString(stored->extents) + ": the stored cost " + std::to_string(stored->expected_cost) +
                    " is not the replayed " + std::to_string(evaluation.expected_cost);
      } else if (stored->lower_bound > stored->expected_cost + kCostTolerance) {
        faults[i] = planner::ToString(stored->extents) + ": the lower bound lies above the cost";
      }
    }
    const std::lock_guard lock(mutex);
    if (hypotheses > 0) ++result.policies;
    result.hypotheses += hypotheses;
    result.largest_cost_error = std::max(result.largest_cost_error, error);
    ++done;
    if (progress) progress(done, result.problems);
  });
  for (const std::string& fault : faults) {
    if (fault.empty()) continue;
    if (result.first_fault.empty()) result.first_fault = fault;
    ++result.faults;
  }
  return result;
}

}  // namespace feeler::workflow
