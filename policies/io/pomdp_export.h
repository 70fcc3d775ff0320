#pragma once

#include <cstddef>
#include <limits>
#include <string>

#include "feeler/planner/belief/problem.h"

namespace feeler::policies {

/// Writes a problem for other solvers (docs/file-formats.md has the encoding and the proof that it is exact).
///
/// States (r, h), r a robot cell reachable under some hypothesis, and `done`, absorbing and free. Actions: the guarded
/// moves, and one `declare` per largest set of hypotheses that is a goal (per hypothesis under goal `singleton`): free
/// if the true hypothesis is among them, else the penalty; then `done`. Observation: the robot cell on arrival. The
/// contact flag is not written because it is known: contact is true exactly when fewer cells were travelled than asked
/// for, and the cells before and after are both observed.
struct PomdpOptions {
  /// In (0, 1]. 1 is the problem itself. Below 1 a cost c of a policy of at most n moves becomes at least
  /// discount^(n-1) c: too small by at most the share 1 - discount^(n-1), and the optimum may be another policy.
  double discount = 1.0;
  /// A proven upper bound of the optimal expected cost, such as the cost of a complete policy; makes the penalty small.
  /// Refused where it is below the proven lower bound of a solver (20,000 expansions).
  /// Infinity: a bound is worked out from the problem.
  double upper_bound = std::numeric_limits<double>::infinity();
  /// Bytes; a file that would be larger is refused before it is written.
  std::size_t max_bytes = 400'000'000;
};

/// Cost of a wrong declaration: at least (bound of the optimal cost) / (smallest normalised weight), rounded up. A
/// policy that declares wrongly under any hypothesis then costs at least the bound by that alone, hence no less than an
/// optimal policy that never does. Throws NegativeResult if a pair of hypotheses cannot be told apart.
double DeclarePenalty(const planner::Problem& problem, const PomdpOptions& options = {});

/// Cassandra's `.pomdp` format, `values: reward` (negated costs: solvers that ignore the line maximise), one flat state
/// space. Throws InputError if options are out of range or the file would exceed
/// `max_bytes`, NegativeResult as above.
std::string FormatPomdp(const planner::Problem& problem, const PomdpOptions& options = {});

/// POMDPX 1.0 with mixed observability: the robot cell a fully observed variable, the hypothesis a hidden one; rewards
/// are negated costs. Same errors.
std::string FormatPomdpx(const planner::Problem& problem, const PomdpOptions& options = {});

}  // namespace feeler::policies
