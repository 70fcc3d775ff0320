#include "feeler/planner/solve.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/bounds/leaving/leaving_bound.h"
#include "feeler/planner/policy/fit_workspace.h"
#include "feeler/planner/policy/indistinguishable.h"
#include "feeler/planner/solve_run.h"

namespace feeler::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Stops between two looks at how much memory the shared tables take.
constexpr int kTableBytesEvery = 256;

void RunSolver(SolveRun& run) {
  switch (run.options.solver) {
    case SolverKind::kCertified: return SolveCertified(run);
    case SolverKind::kRtdpBel: return SolveRtdpBel(run);
    case SolverKind::kERtdpBel: return SolveERtdpBel(run);
  }
}

/// One attempt, from the start belief to the result; the accounts in it are those of all attempts so far.
SolverResult Attempt(const Problem& problem, const SolverOptions& options, const PlanningTables& tables,
                     const Experience& experience, StopWatch& watch, bool canonical,
                     const PolicyGraph* known = nullptr) {
  SolveRun run(problem, options, tables, experience, watch, canonical, known);
  SolverResult& result = run.result;
  if (run.start == kNoBelief) {
    result.policy = FreezePolicy(run.graph, [](BeliefId) { return GuardedMove(); });
  } else {
    RunSolver(run);
  }
  if (result.policy) {
    result.expected_cost = result.policy->expected_cost;
    result.lower_bound = std::min(result.lower_bound, result.expected_cost);  // rounding
    result.policy->lower_bound = result.lower_bound;
  }
  run.Row(result.trials, result.expansions, result.lower_bound, result.expected_cost);
  watch.EndAttempt(result.expansions);
  return std::move(result);
}

/// What is known without a policy when nothing could be tried, or need not be.
SolverResult WithoutPolicy(SolverStatus status) {
  SolverResult result;
  result.status = status;
  result.expected_cost = kInfinity;
  return result;
}

bool Cancelled(const SolverOptions& options) {
  return options.cancellation != nullptr && options.cancellation->cancelled();
}

/// Attempts until one has a policy that stays in the workspace, or a limit holds.
SolverResult SolveInWorkspace(const Problem& problem, const SolverOptions& options, const PlanningTables& tables,
                              const Experience& experience, StopWatch& watch) {
  const bool canonical =
      options.canonical_translation && problem.generous_workspace && options.solver != SolverKind::kERtdpBel;
  SolverResult first = Attempt(problem, options, tables, experience, watch, canonical);
  if (!canonical || !first.policy || StaysInWorkspace(problem, *first.policy)) return first;
  // Further actions may cost something: what was promised must still hold.
  const double factor = options.solver == SolverKind::kCertified ? options.gap : options.epsilon;
  std::optional<PolicyGraph> fitted = FitIntoWorkspace(problem, *first.policy);
  const bool kept = fitted && (fitted->expected_cost <= first.expected_cost * (1.0 + 1e-12) ||
                               fitted->expected_cost <= factor * first.lower_bound);
  SolverResult result = first;
  if (!kept) {
    result = Attempt(problem, options, tables, experience, watch, false);
    // A limit came before the second policy, or before it was as good.
    const bool worse = fitted && (!result.policy || fitted->expected_cost < result.expected_cost);
    if (!worse) return result;
    result.lower_bound = std::max(result.lower_bound, first.lower_bound);
  }
  result.expected_cost = fitted->expected_cost;
  result.policy = std::move(fitted);
  result.lower_bound = std::min(result.lower_bound, result.expected_cost);
  return result;
}

/// Weights rule out translates that count as one, and bounds that are tight. So the problem is solved as if all
/// hypotheses were equally likely first, with half of what the limits allow; what that policy costs under the weights
/// is then known, and the search for the weights begins with it.
SolverResult SolveFromEqualWeights(const Problem& problem, const SolverOptions& options, const PlanningTables& tables,
                                   StopWatch& watch) {
  Problem equal = problem;
  for (Hypothesis& h : equal.hypotheses) h.weight = 1.0;
  SolverOptions quiet = options;  // its bounds are those of another problem
  quiet.on_bounds = nullptr;
  watch.LimitTo(0.5);
  SolverResult first = SolveInWorkspace(equal, quiet, tables, {}, watch);
  watch.LimitTo(1.0);
  if (first.status == SolverStatus::kUnlocalizable) return first;
  return Attempt(problem, options, tables, {}, watch, false, first.policy ? &*first.policy : nullptr);
}

SolverResult SolveByAttempts(const Problem& problem, const SolverOptions& options, const PlanningTables& tables,
                             const Experience& experience, StopWatch& watch) {
  if (!problem.generous_workspace) {
    auto pairs = IndistinguishablePairs(problem, tables.masks());
    if (!pairs.empty()) {
      SolverResult result = WithoutPolicy(SolverStatus::kUnlocalizable);
      result.lower_bound = kInfinity;
      result.indistinguishable = std::move(pairs);
      return result;
    }
  }
  const bool equal_weights_help = options.solver == SolverKind::kCertified && options.canonical_translation &&
                                  problem.generous_workspace && !EquallyLikely(problem);
  if (equal_weights_help) return SolveFromEqualWeights(problem, options, tables, watch);
  return SolveInWorkspace(problem, options, tables, experience, watch);
}

}  // namespace

SolveRun::SolveRun(const Problem& problem, const SolverOptions& solver_options, const PlanningTables& planning_tables,
                   const Experience& given_experience, StopWatch& stop_watch, bool canonical,
                   const PolicyGraph* known_policy)
    : options(solver_options),
      tables(planning_tables),
      experience(given_experience),
      watch(stop_watch),
      known(known_policy),
      graph(problem, tables.masks(), canonical),
      heuristic(tables.MakeHeuristic(problem, graph.sets())) {
  if (options.solver == SolverKind::kCertified && options.heuristic == HeuristicKind::kCertificate &&
      LeavingBound::Fits(problem)) {
    heuristic = std::make_unique<WithLeavingBound>(problem, graph.sets(), std::move(heuristic));
  }
  graph.SetHeuristic(heuristic.get());
  result.expected_cost = kInfinity;
  start = graph.Start();
  if (start != kNoBelief) weight = graph.Weight(start);
}

std::optional<SolverStatus> SolveRun::Stop(std::int64_t expansions, std::size_t search_bytes) {
  if (stops_++ % kTableBytesEvery == 0) table_bytes_ = tables.bytes();
  const std::size_t bytes = table_bytes_ + graph.bytes() + heuristic->bytes() + search_bytes;
  if (bytes > options.memory_limit_bytes) return SolverStatus::kMemoryLimit;
  return watch.Stop(expansions);
}

void SolveRun::Row(std::int64_t trials, std::int64_t expansions, double lower, double upper) const {
  if (!options.on_bounds) return;
  options.on_bounds({watch.wall_s(), trials, watch.expansions_before() + expansions, lower, upper});
}

std::string_view ToString(SolverStatus status) {
  switch (status) {
    case SolverStatus::kConverged: return "converged";
    case SolverStatus::kGap: return "gap";
    case SolverStatus::kTimeLimit: return "time_limit";
    case SolverStatus::kExpansionLimit: return "expansion_limit";
    case SolverStatus::kCancelled: return "cancelled";
    case SolverStatus::kUnlocalizable: return "unlocalizable";
    case SolverStatus::kMemoryLimit: return "memory_limit";
    case SolverStatus::kRounding: return "rounding";
  }
  return "?";
}

std::string_view ToString(ExperienceKind kind) {
  switch (kind) {
    case ExperienceKind::kRollout: return "rollout";
    case ExperienceKind::kNaive: return "naive";
    case ExperienceKind::kNone: return "none";
  }
  return "?";
}

double SolverResult::Ratio() const {
  if (!policy) return kInfinity;
  if (lower_bound > 0.0) return expected_cost / lower_bound;
  return expected_cost > 0.0 ? kInfinity : 1.0;
}

SolverResult Solve(const Problem& problem, const SolverOptions& options, std::shared_ptr<const PlanningTables> tables,
                   const Experience& experience) {
  Validate(problem);
  Validate(options);
  if (experience.kind == ExperienceKind::kNaive && experience.policy != nullptr && experience.problem == nullptr) {
    throw InputError("experience", "a naive experience needs the problem its policy was made for",
                     "pass the problem too");
  }
  StopWatch watch(options);
  if (!tables) tables = BuildPlanningTables(problem, options);
  // Tables are incomplete where a cancellation came while they were built.
  SolverResult result = Cancelled(options) ? WithoutPolicy(SolverStatus::kCancelled)
                                           : SolveByAttempts(problem, options, *tables, experience, watch);
  result.expansions = watch.expansions_before();
  result.wall_s = watch.wall_s();
  result.cpu_s = watch.cpu_s();
  return result;
}

}  // namespace feeler::planner
