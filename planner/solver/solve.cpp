#include "planner/solver/solve.h"

#include <limits>
#include <utility>

#include "planner/belief/belief_graph.h"
#include "planner/solver/freeze_policy.h"
#include "planner/solver/planning_tables.h"
#include "planner/solver/rtdp_bel.h"
#include "planner/solver/stop_watch.h"

namespace feeler::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

SolverResult SolveByRtdpBel(const Problem& problem, const SolverOptions& options, const PlanningTables& tables,
                            bool canonical) {
  StopWatch watch(options);
  BeliefGraph graph(problem, tables.masks(), canonical);
  const auto heuristic = tables.MakeHeuristic(problem, graph.sets(), options);
  graph.SetHeuristic(heuristic.get());
  SolverResult result;
  result.expected_cost = kInfinity;
  const BeliefId start = graph.Start();
  if (start != kNoBelief) {
    const double weight = graph.Weight(start);
    RtdpBel search(
        graph, [&](BeliefId b) { return options.epsilon * graph.Heuristic(b); }, options.seed);
    const auto lower = [&] { return std::max(search.Lower(start), search.Value(start) / options.epsilon) / weight; };
    const auto stop = [&](std::int64_t expansions) {
      if (watch.RowDue()) {
        options.on_bounds({watch.wall_s(), search.trials(), expansions, lower(), kInfinity});
      }
      return watch.Stop(expansions);
    };
    if (const auto why = search.Run(start, stop)) {
      result.status = *why;
    } else {
      result.policy = FreezePolicy(graph, [&](BeliefId b) { return search.Action(b); });
    }
    result.lower_bound = lower();
    result.trials = search.trials();
    result.expansions = search.expansions();
  } else {
    result.policy = FreezePolicy(graph, [](BeliefId) { return 0; });
  }
  if (result.policy) {
    result.expected_cost = result.policy->expected_cost;
    result.lower_bound = std::min(result.lower_bound, result.expected_cost);
    result.policy->lower_bound = result.lower_bound;
  }
  if (options.on_bounds) {
    options.on_bounds({watch.wall_s(), result.trials, result.expansions, result.lower_bound, result.expected_cost});
  }
  result.wall_s = watch.wall_s();
  result.cpu_s = watch.cpu_s();
  return result;
}

}  // namespace

std::string_view ToString(SolverStatus status) {
  switch (status) {
    case SolverStatus::kConverged: return "converged";
    case SolverStatus::kGap: return "gap";
    case SolverStatus::kTimeLimit: return "time_limit";
    case SolverStatus::kExpansionLimit: return "expansion_limit";
    case SolverStatus::kCancelled: return "cancelled";
    case SolverStatus::kUnlocalizable: return "unlocalizable";
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
  static_cast<void>(experience);
  if (!tables) tables = BuildPlanningTables(problem, options);
  const bool canonical = options.canonical_translation && problem.generous_workspace;
  SolverResult result = SolveByRtdpBel(problem, options, *tables, canonical);
  if (canonical && result.policy && !StaysInWorkspace(problem, *result.policy)) {
    result = SolveByRtdpBel(problem, options, *tables, false);
  }
  return result;
}

}  // namespace feeler::planner
