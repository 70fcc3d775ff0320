#pragma once

#include <memory>
#include <string_view>

#include "feeler/planner/belief/problem.h"
#include "feeler/planner/bounds/build_tables.h"
#include "feeler/planner/options/solver_options.h"
#include "feeler/planner/options/solver_result.h"
#include "feeler/planner/policy/policy_graph.h"

namespace feeler::planner {

/// Where E-RTDP-Bel takes its experience from (the paper, Section V-C and Table III).
enum class ExperienceKind {
  kRollout,  ///< the histories of the policy, rolled out from the new start belief
  kNaive,    ///< the transitions of the policy as they are
  kNone,
};
std::string_view ToString(ExperienceKind kind);

struct Experience {
  ExperienceKind kind = ExperienceKind::kNone;
  const Problem* problem = nullptr;     ///< the similar problem
  const PolicyGraph* policy = nullptr;  ///< its solution
};

/// Solves one problem. Deterministic given problem, options and experience, unless a time limit or a cancellation stops
/// it. `tables` from `BuildPlanningTables` of a problem of the same family, or null to build them here. Throws
/// InputError for an invalid problem or options. An unlocalizable problem is a status, not an error.
SolverResult Solve(const Problem& problem, const SolverOptions& options,
                   std::shared_ptr<const PlanningTables> tables = nullptr, const Experience& experience = {});

}  // namespace feeler::planner
