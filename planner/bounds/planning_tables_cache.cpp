#include "feeler/planner/bounds/planning_tables_cache.h"

#include <algorithm>
#include <set>
#include <utility>

#include "feeler/planner/belief/hull.h"

namespace feeler::planner {
namespace {

/// True if the two have the same steps: map, costs of moves, and which hypotheses a goal leaves together.
bool SameSteps(const Problem& a, const Problem& b) {
  return a.map == b.map && a.cost == b.cost && a.move_lengths == b.move_lengths && a.goal == b.goal &&
         a.pitches == b.pitches && (a.goal == GoalKind::kSingleton || a.insertable_spread == b.insertable_spread) &&
         a.generous_workspace == b.generous_workspace;
}

bool SameHypotheses(const Problem& a, const Problem& b) {
  return std::ranges::equal(a.hypotheses, b.hypotheses, [](const Hypothesis& one, const Hypothesis& other) {
    return one.offset == other.offset && one.orientation == other.orientation;
  });
}

/// True if the hypotheses of `b` span no more than those of `a` and have no other orientations.
bool Covers(const Problem& a, const Problem& b) {
  const Cell wide = HullOf(a.hypotheses).Size();
  const Cell narrow = HullOf(b.hypotheses).Size();
  std::set<int> orientations;
  for (const Hypothesis& h : a.hypotheses) orientations.insert(h.orientation);
  return (wide.array() >= narrow.array()).all() &&
         std::ranges::all_of(b.hypotheses, [&](const Hypothesis& h) { return orientations.contains(h.orientation); });
}

}  // namespace

bool PlanningTablesCache::Serves(const Entry& entry, const Problem& problem, const SolverOptions& options) {
  if (entry.solver != options.solver || entry.heuristic != options.heuristic) return false;
  if (!SameSteps(entry.problem, problem)) return false;
  // Lattice files have tables for one problem: its workspace and its hypotheses in their order.
  if (!problem.generous_workspace) {
    return entry.problem.workspace == problem.workspace && SameHypotheses(entry.problem, problem);
  }
  const bool any_hypotheses = problem.map->orientations() == 1 && options.heuristic != HeuristicKind::kCuboids;
  return any_hypotheses || Covers(entry.problem, problem);
}

std::shared_ptr<const PlanningTables> PlanningTablesCache::TablesFor(const Problem& problem,
                                                                     const SolverOptions& options) {
  const std::lock_guard lock(mutex_);
  const auto known = std::find_if(entries_.rbegin(), entries_.rend(),
                                  [&](const Entry& entry) { return Serves(entry, problem, options); });
  if (known != entries_.rend()) {
    std::rotate(known.base() - 1, known.base(), entries_.end());
    return entries_.back().tables;
  }
  auto tables = BuildPlanningTables(problem, options, {}, store_.get());
  if (options.cancellation != nullptr && options.cancellation->cancelled()) return tables;  // may be incomplete
  if (entries_.size() == kMost) entries_.erase(entries_.begin());
  entries_.push_back({problem, options.solver, options.heuristic, std::move(tables)});
  return entries_.back().tables;
}

}  // namespace feeler::planner
