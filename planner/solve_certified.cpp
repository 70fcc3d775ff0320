#include <algorithm>
#include <cmath>
#include <functional>
#include <type_traits>

#include "feeler/planner/policy/fit_workspace.h"
#include "feeler/planner/policy/indistinguishable.h"
#include "feeler/planner/search/bounded_search.h"
#include "feeler/planner/search/given_policy.h"
#include "feeler/planner/search/greedy_completion.h"
#include "feeler/planner/search/open_policy.h"
#include "feeler/planner/search/random_judgement.h"
#include "feeler/planner/solve_run.h"

// The certified solver: a first policy, then BoundedSearch until the gap is closed or a limit holds.
namespace feeler::planner {
namespace {

using Greedy = GreedyCompletion<BeliefGraph>;

/// Up to so many hypotheses the greedy policy is tried beside the one for openings.
constexpr std::uint32_t kGreedyBesideOpen = 256;
/// Where hypotheses have orientations, which makes the heuristic loose: at most so many further greedy policies, and
/// the inflation of the heuristic in the guess of BoundedSearch.
constexpr std::uint64_t kFurtherPolicies = 120;
constexpr double kGuessInflation = 1.3;

/// After this share of a limit a policy that leaves the workspace is given up: the rest is for the next attempt. (Not
/// with orientations: a first policy alone may take more than that.)
constexpr double kBeforeNextAttempt = 0.6;

bool Oriented(const SolveRun& run) { return run.graph.problem().map->orientations() > 1; }

/// By what the greedy policy judges beliefs, where that is not the heuristic itself.
std::function<double(BeliefId)> EstimateOf(SolveRun& run) {
  if (run.options.heuristic != HeuristicKind::kCuboids) return {};
  return [&run](BeliefId b) { return run.heuristic->Estimate(run.graph.set(b), run.graph.robot(b)); };
}

/// The stop condition while there is no policy yet.
template <class Search>
std::function<std::optional<SolverStatus>(std::int64_t)> FirstPolicyStop(SolveRun& run, const Search& search) {
  return [&run, &search](std::int64_t expansions) {
    const std::optional<SolverStatus> why = run.Stop(expansions, search.bytes());
    const bool budget = why == SolverStatus::kTimeLimit || why == SolverStatus::kExpansionLimit;
    return run.options.first_policy_in_any_case && budget && run.known == nullptr ? std::nullopt : why;
  };
}

/// The policy that is known beforehand, if any, and what it is worth here.
void TakeKnown(SolveRun& run, Greedy& greedy) {
  if (run.known == nullptr) return;
  const MoveMap moves = MovesOf(run.graph, *run.known);
  greedy.Take(run.start, [&](BeliefId b) { return run.graph.ActionOf(b, moves.at(b)); });
}

/// The greedy policy. False, and says why in the result, if some hypotheses cannot be told apart or it was stopped.
bool Complete(SolveRun& run, Greedy& greedy) {
  const auto why = greedy.Run(run.start, FirstPolicyStop(run, greedy));
  run.result.expansions = greedy.expansions();
  if (!why) return true;
  if (greedy.Solved(run.start)) return true;  // by the policy that was known
  run.result.status = *why;
  if (why == SolverStatus::kUnlocalizable) {
    run.result.lower_bound = std::numeric_limits<double>::infinity();
    run.result.indistinguishable = IndistinguishablePairs(run.graph.problem(), run.tables.masks());
  }
  return false;
}

/// With orientations both the first policy and the bound at the start may be far off: further policies and the search
/// go by turns, each with as many expansions as the other, until the gap is closed or `stop` says why not to go on.
template <class Search, class Stop>
std::optional<SolverStatus> CloseGapByTurns(SolveRun& run, Greedy& greedy, Search& search, Stop stop) {
  for (std::uint64_t number = 0; number < kFurtherPolicies; ++number) {
    const auto judgement = RandomJudgement(run.graph, run.options.seed, number);
    const auto stop_greedy = [&](std::int64_t) { return stop(search.expansions()); };
    if (const auto why = greedy.Run(run.start, stop_greedy, judgement)) return why;
    const std::int64_t turn = 2 * greedy.expansions();
    std::optional<SolverStatus> why;
    const auto over = search.Run(run.start, [&](std::int64_t expansions) {
      why = stop(expansions);
      return !why && expansions >= turn ? SolverStatus::kExpansionLimit : why;
    });
    if (why || !over) return why;
  }
  return search.Run(run.start, stop);
}

/// Whether the policy that a search has found would have to be made anew: in canonical frames it may leave the
/// workspace.
template <class Search>
bool LeavesWorkspace(SolveRun& run, Search& search) {
  const PolicyGraph policy = run.Freeze(search);
  return !StaysInWorkspace(run.graph.problem(), policy) && !FitIntoWorkspace(run.graph.problem(), policy);
}

/// From the incumbent's policy until cost and lower bound meet within the gap.
template <class Incumbent>
void CloseGap(SolveRun& run, Incumbent& incumbent) {
  SolverResult& result = run.result;
  BoundedSearch search(run.graph, incumbent, run.options.gap, Oriented(run) ? kGuessInflation : 1.0);
  const auto lower = [&] { return std::max(result.lower_bound, search.Lower(run.start) / run.weight); };
  bool asked = !run.graph.canonical() || Oriented(run);
  const auto stop = [&](std::int64_t expansions) -> std::optional<SolverStatus> {
    const double upper = search.Upper(run.start) / run.weight;
    if (run.RowDue()) run.Row(search.trials(), expansions, lower(), upper);
    if (upper <= run.options.gap * lower()) return SolverStatus::kGap;
    if (const auto why = run.Stop(expansions, search.bytes() + incumbent.bytes())) return why;
    const auto spent = asked ? std::nullopt : run.watch.Spent(kBeforeNextAttempt, expansions);
    if (!spent) return std::nullopt;
    asked = true;
    return LeavesWorkspace(run, search) ? spent : std::nullopt;
  };
  std::optional<SolverStatus> why;
  if constexpr (std::is_same_v<Incumbent, Greedy>) {
    why = Oriented(run) ? CloseGapByTurns(run, incumbent, search, stop) : search.Run(run.start, stop);
  } else {
    why = search.Run(run.start, stop);
  }
  result.lower_bound = lower();
  result.trials = search.trials();
  result.expansions = search.expansions();
  result.status = why.value_or(SolverStatus::kGap);
  result.policy = run.Freeze(search);
  if (result.policy->expected_cost <= result.lower_bound * (1.0 + 1e-9) + 1e-9) {
    result.status = SolverStatus::kConverged;
  }
}

/// The problem on the map whose dead ends are filled; none where there are none, or the tool is in one.
std::optional<Problem> WithoutDeadEnds(const SolveRun& run) {
  const Problem& problem = run.graph.problem();
  if (!problem.generous_workspace || !run.tables.filled().map) return std::nullopt;
  Problem without = problem;
  without.map = run.tables.filled().map;
  for (const Hypothesis& h : problem.hypotheses) {
    if (Blocked(without, problem.start, h)) return std::nullopt;
  }
  return without;
}

/// Dead ends make beliefs many and the greedy choice short-sighted (it looks into them one by one): the first policy is
/// made from one for the map on which they are filled.
void SolveWithOpenings(SolveRun& run, const Problem& filled, Greedy& greedy) {
  const PlanningTables::Filled& tables = run.tables.filled();
  BeliefGraph filled_graph(filled, tables.tables->masks(), run.graph.canonical());
  const auto heuristic = tables.tables->MakeHeuristic(filled, filled_graph.sets());
  filled_graph.SetHeuristic(heuristic.get());
  OpenPolicy open(run.graph, filled_graph, tables.openings, greedy);
  const auto why = open.Run(run.start, FirstPolicyStop(run, open));
  run.result.expansions = open.expansions();
  const bool small = run.graph.sets().info(run.graph.set(run.start)).size <= kGreedyBesideOpen;
  if (why && !open.Solved(run.start)) {
    run.result.status = *why;
    return;
  }
  if (small || !open.Solved(run.start)) Complete(run, greedy);
  run.result.expansions = open.expansions();
  if (open.Solved(run.start)) CloseGap(run, open);
}

}  // namespace

void SolveCertified(SolveRun& run) {
  run.result.lower_bound = run.graph.Heuristic(run.start) / run.weight;
  Greedy greedy(run.graph, EstimateOf(run));
  TakeKnown(run, greedy);
  if (const std::optional<Problem> filled = WithoutDeadEnds(run)) return SolveWithOpenings(run, *filled, greedy);
  if (!Complete(run, greedy)) return;
  CloseGap(run, greedy);
}

}  // namespace feeler::planner
