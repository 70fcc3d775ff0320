#pragma once

#include <memory>

#include "feeler/core/parallelism.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/planner/options/solver_options.h"

namespace feeler::planner {

/// Read-only tables that depend on the contact map, the costs and the goal but not on the hypotheses: contact masks and
/// heuristic values. Built once, shared by all problems of a family and by any number of threads.
class PlanningTables;
/// Builds what `options` needs for problems with the map, costs, move lengths and goal of `problem`; tables of cuboids,
/// with `jobs` threads, for hypotheses that span no more than those of `problem` (larger sets are cut).
/// After a cancellation of `options` they are incomplete: nothing may be looked up in them (`Solve` does not).
/// With a store (whatever its key) they are made once a host: the first process keeps them as files, the others map
/// these. So are tables of pairs of turned hypotheses, which are made when first asked for (SharedPool); those of one
/// orientation stay each process' own.
std::shared_ptr<const PlanningTables> BuildPlanningTables(const Problem& problem, const SolverOptions& options,
                                                          Parallelism jobs = {}, const ArrayStore* store = nullptr);

}  // namespace feeler::planner
