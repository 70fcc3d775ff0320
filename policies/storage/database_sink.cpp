#include "feeler/policies/storage/database_sink.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/version.h"

namespace feeler::policies {

bool DatabaseSink::Done(const planner::Extents& extents) {
  const auto stored = database_.Get(extents);
  return stored && (stored->policy || stored->status == ToString(planner::SolverStatus::kUnlocalizable));
}

std::optional<planner::PolicyGraph> DatabaseSink::Load(const planner::Extents& extents) {
  auto stored = database_.Get(extents);
  return stored ? std::move(stored->policy) : std::nullopt;
}

void DatabaseSink::Store(const planner::Extents& extents, const planner::Problem& problem,
                         const planner::SolverResult& result) {
  (void)problem;  // extents and task determine it
  database_.Put(ToStoredProblem(extents, options_, result));
}

StoredProblem ToStoredProblem(const planner::Extents& extents, const planner::SolverOptions& options,
                              const planner::SolverResult& result) {
  StoredProblem problem;
  problem.extents = extents;
  problem.status = ToString(result.status);
  problem.solver = ToString(options.solver);
  (problem.certified() ? problem.gap : problem.epsilon) = problem.certified() ? options.gap : options.epsilon;
  // Of a problem that no policy solves the cost is infinite, which a row cannot hold: nothing is proven there.
  problem.lower_bound = std::isfinite(result.lower_bound) ? result.lower_bound : 0.0;
  problem.expansions = result.expansions;
  problem.seed = options.seed;
  problem.version = FEELER_VERSION;
  problem.cpu_s = result.cpu_s;
  problem.wall_s = result.wall_s;
  problem.policy = result.policy;
  if (problem.policy) {
    // One number for each: the policy's own, and the better of two proven bounds.
    problem.expected_cost = problem.policy->expected_cost;
    problem.policy->lower_bound = std::max(problem.policy->lower_bound, result.lower_bound);
    problem.lower_bound = problem.policy->lower_bound;
  }
  return problem;
}

}  // namespace feeler::policies
