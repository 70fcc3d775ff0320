#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/policy/freeze_policy.h"
#include "feeler/planner/search/fewest_moves.h"
#include "feeler/planner/search/stop_watch.h"
#include "feeler/planner/solve.h"

namespace feeler::planner {

/// One attempt at a problem, as the solvers share it: the belief graph with its heuristic, the stop condition, and the
/// result that a solver fills in.
struct SolveRun {
  /// `watch` is the one of all attempts; `known` a valid policy for the problem, or null. Everything outlives the run.
  SolveRun(const Problem& problem, const SolverOptions& options, const PlanningTables& tables,
           const Experience& experience, StopWatch& watch, bool canonical, const PolicyGraph* known);
  SolveRun(const SolveRun&) = delete;
  SolveRun& operator=(const SolveRun&) = delete;

  /// Why to stop now, after so many expansions of this attempt and with so much memory in the searches; empty to go on.
  std::optional<SolverStatus> Stop(std::int64_t expansions, std::size_t search_bytes);
  /// Whether somebody listens and a row of the bounds table is due: who is not heard uses up no row of the next search.
  bool RowDue() { return options.on_bounds && watch.RowDue(); }
  /// Reports a row of the bounds table; `expansions` of this attempt.
  void Row(std::int64_t trials, std::int64_t expansions, double lower, double upper) const;

  /// The policy that a search found, with as few moves as its cost allows.
  template <class Search>
  PolicyGraph Freeze(Search& search) {
    const MoveMap moves = FewestMoves(graph, [&](BeliefId b) {
      const BeliefAction& action = graph.Actions(b)[static_cast<std::size_t>(search.Action(b))];
      return GuardedMove{action.direction, action.cells};
    });
    return FreezePolicy(graph, [&](BeliefId b) { return moves.at(b); });
  }

  const SolverOptions& options;
  const PlanningTables& tables;
  const Experience& experience;
  StopWatch& watch;
  const PolicyGraph* known;  ///< to begin with (certified solver); null: none
  BeliefGraph graph;
  std::unique_ptr<BeliefHeuristic> heuristic;
  BeliefId start = kNoBelief;  ///< none: the problem is solved before the first move
  double weight = 1.0;         ///< of the start belief
  SolverResult result;

 private:
  std::size_t table_bytes_ = 0;
  int stops_ = 0;
};

/// The solvers. Each fills in the policy (if it found one), its lower bound, status, trials and expansions.
void SolveCertified(SolveRun& run);
/// Algorithm 1 of the paper, with epsilon * heur.
void SolveRtdpBel(SolveRun& run);
/// Algorithm 2: RTDP-Bel with heur^E (equation 5) in place of it; without experience RTDP-Bel.
void SolveERtdpBel(SolveRun& run);

}  // namespace feeler::planner
