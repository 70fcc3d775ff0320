#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/parallelism.h"
#include "planner/belief/problem.h"
#include "planner/solver/options.h"
#include "planner/solver/policy.h"

namespace feeler::planner {

enum class SolverStatus { kConverged, kGap, kTimeLimit, kExpansionLimit, kCancelled, kUnlocalizable };
/// "converged", "gap", "time_limit", "expansion_limit", "cancelled", "unlocalizable".
std::string_view ToString(SolverStatus status);

struct SolverResult {
  SolverStatus status = SolverStatus::kConverged;
  std::optional<Policy> policy;  ///< the best complete policy; empty if there is none (yet)
  double expected_cost = 0.0;    ///< exact, over every hypothesis; infinity without a policy
  double lower_bound = 0.0;      ///< proven, never inflated
  std::int64_t trials = 0;
  std::int64_t expansions = 0;  ///< beliefs whose actions were all evaluated
  double cpu_s = 0.0;           ///< of the solving thread
  double wall_s = 0.0;
  /// Pairs of indices of hypotheses that no probe tells apart (and the goal needs apart); empty unless unlocalizable.
  std::vector<std::pair<int, int>> indistinguishable;

  bool complete() const { return policy.has_value(); }
  /// Expected cost / lower bound; 1 if both are zero; infinity without a policy.
  double Ratio() const;
};

/// Read-only tables that depend on the contact map, the costs and the goal but not on the hypotheses: contact masks and
/// heuristic values. Built once, shared by all problems of a family and by any number of threads.
class PlanningTables;
/// Builds what `options` needs for problems with the map, costs, move lengths and goal of `problem`; tables of cuboids,
/// with `jobs` threads, for hypotheses that span no more than those of `problem` (larger sets are cut).
std::shared_ptr<const PlanningTables> BuildPlanningTables(const Problem& problem, const SolverOptions& options,
                                                          Parallelism jobs = {});

/// Where E-RTDP-Bel takes its experience from (the paper, Section V-C and Table III).
enum class ExperienceKind {
  kRollout,  ///< the histories of the policy, rolled out from the new start belief
  kNaive,    ///< the transitions of the policy as they are
  kNone,
};
std::string_view ToString(ExperienceKind kind);

struct Experience {
  ExperienceKind kind = ExperienceKind::kNone;
  const Problem* problem = nullptr;  ///< the similar problem
  const Policy* policy = nullptr;    ///< its solution
};

/// Solves one problem. Deterministic given problem, options and experience, unless a time limit or a cancellation stops
/// it. `tables` from `BuildPlanningTables` of a problem of the same family, or null to build them here. Throws
/// InputError for an invalid problem or options. An unlocalizable problem is a status, not an error.
SolverResult Solve(const Problem& problem, const SolverOptions& options,
                   std::shared_ptr<const PlanningTables> tables = nullptr, const Experience& experience = {});

}  // namespace feeler::planner
