#include <algorithm>
#include <limits>
#include <utility>

#include "feeler/planner/search/experience.h"
#include "feeler/planner/search/rtdp_bel.h"
#include "feeler/planner/solve_run.h"

namespace feeler::planner {
namespace {

/// RTDP-Bel from `initial`, the value of a belief that was not met yet, times its weight.
template <class Initial>
void Search(SolveRun& run, Initial initial) {
  RtdpBel search(run.graph, initial, run.options.seed);
  const auto lower = [&] {
    return std::max(search.Lower(run.start), search.Value(run.start) / run.options.epsilon) / run.weight;
  };
  const auto why = search.Run(run.start, [&](std::int64_t expansions) {
    if (run.RowDue()) run.Row(search.trials(), expansions, lower(), std::numeric_limits<double>::infinity());
    return run.Stop(expansions, search.bytes());
  });
  run.result.lower_bound = lower();
  run.result.trials = search.trials();
  run.result.expansions = search.expansions();
  if (why) {
    run.result.status = *why;
  } else {
    run.result.policy = run.Freeze(search);
  }
}

}  // namespace

void SolveRtdpBel(SolveRun& run) {
  Search(run, [&](BeliefId b) { return run.options.epsilon * run.graph.Heuristic(b); });
}

void SolveERtdpBel(SolveRun& run) {
  const Experience& experience = run.experience;
  if (experience.kind == ExperienceKind::kNone || experience.policy == nullptr) return SolveRtdpBel(run);
  ExperienceMdp mdp = experience.kind == ExperienceKind::kRollout
                          ? RollOut(run.graph, *experience.policy)
                          : Transplant(run.graph, *experience.problem, *experience.policy);
  ExperienceHeuristic heuristic(run.graph, std::move(mdp), run.options.epsilon, run.options.jumps);
  Search(run, [&](BeliefId b) { return run.graph.Weight(b) * heuristic(b); });
}

}  // namespace feeler::planner
