#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "feeler/planner/options/solver_options.h"
#include "feeler/planner/options/solver_result.h"
#include "feeler/planner/pomdp/model/controller.h"
#include "feeler/planner/pomdp/model/full_alpha_vector.h"
#include "feeler/planner/pomdp/model/pomdp.h"
#include "feeler/planner/pomdp/model/simulate.h"

namespace feeler::planner {

/// How a general POMDP is solved. The first three are the searches of lattice problems on another model
/// (PomdpBeliefGraph); `kPointBased` stands beside them because a value function that generalises between beliefs
/// closes the gap of discounted problems far sooner (docs/pomdp.md has figures).
enum class PomdpSolverKind {
  kPointBased,  ///< PointBasedSearch; discounts below 1
  kCertified,   ///< BoundedSearch over exact beliefs
  kRtdpBel,
  kERtdpBel,
};
/// "point-based", "certified", "rtdp-bel", "e-rtdp-bel".
std::string_view ToString(PomdpSolverKind kind);

/// One row of the bounds table: values in reward terms.
struct ValueBounds {
  double wall_s = 0.0;
  std::int64_t trials = 0;
  std::int64_t expansions = 0;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

struct PomdpSolverOptions {
  /// Point-based where the discount is below 1, else certified.
  static PomdpSolverKind DefaultKind(const Pomdp& pomdp) {
    return pomdp.discount < 1.0 ? PomdpSolverKind::kPointBased : PomdpSolverKind::kCertified;
  }
  PomdpSolverKind kind = PomdpSolverKind::kPointBased;
  /// Stop when value_upper - value_lower is at most this, in rewards; > 0.
  double precision = 1e-3;
  /// Levels of RTDP-Bel's discretisation d(b)(s) = ceil(D b(s)), of it and E-RTDP-Bel alone; >= 0, 0: none.
  int levels = 15;
  /// With levels above 0: goes on with trials over the beliefs themselves where the labelled search over discretised
  /// ones has ended (RtdpBel::RunExactly), until the value of the initial belief moves by no more than `precision`.
  bool exact_trials = true;
  double epsilon = 1.0;  ///< inflation of their heuristic, in costs to the goal; >= 1
  double time_limit_s = std::numeric_limits<double>::infinity();
  std::int64_t expansion_limit = std::numeric_limits<std::int64_t>::max();
  std::size_t memory_limit_bytes = std::size_t{1} << 32;
  std::uint64_t seed = 1;
  /// Episodes of the controller of RTDP-Bel or E-RTDP-Bel to simulate after the search; 0: none.
  int simulate = 0;
  const PomdpController* experience = nullptr;  ///< of E-RTDP-Bel: a policy of a similar problem; may be null
  const CancellationToken* cancellation = nullptr;
  std::function<void(const ValueBounds&)> on_bounds;
};

/// Throws InputError naming the option that is out of range.
void Validate(const PomdpSolverOptions& options);

struct PomdpResult {
  SolverStatus status = SolverStatus::kConverged;
  double value_lower =
      -std::numeric_limits<double>::infinity();  ///< proven; what the controller is worth, where there is one
  double value_upper = std::numeric_limits<double>::infinity();  ///< proven
  std::optional<PomdpController> controller;
  std::vector<FullAlphaVector> alphas;  ///< of the point-based search: the vectors of its plan
  std::optional<SimulationResult> simulated;
  std::size_t classes = 0, beliefs = 0;
  std::int64_t trials = 0, expansions = 0;
  double cpu_s = 0.0, wall_s = 0.0;  ///< CPU of the solving thread
};

/// Solves a POMDP. Values are those of the file: rewards (costs negated), with its discount. Deterministic but for time
/// limits and cancellation. Throws InputError for options or a model that cannot be solved, NegativeResult if no policy
/// reaches a goal even where the state is observed.
PomdpResult SolvePomdp(const Pomdp& pomdp, const PomdpSolverOptions& options);

}  // namespace feeler::planner
