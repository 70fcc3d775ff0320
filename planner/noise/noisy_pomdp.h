#pragma once

#include "feeler/planner/noise/noisy_problem.h"
#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// A noisy problem as a goal POMDP in tables: states (robot cell, contact flag of the last reading, hypothesis) and
/// `done`; moves, and a declaration per largest goal set that pays for being wrong; the cell and the flag are observed.
/// Moves without room end the episode as given up.
///
/// Declarations may be made at any probability here (a POMDP cannot forbid it), so that the optimal cost is at most
/// that of the problem, and the same where the best policy declares nothing below the confidence asked for. Costs are
/// negated rewards. Throws InputError if the tables would take too much memory.
Pomdp MakeNoisyPomdp(const NoisyProblem& noisy);

}  // namespace feeler::planner
