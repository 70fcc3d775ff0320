#pragma once

#include <map>
#include <utility>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/lattice.h"
#include "feeler/core/task.h"
#include "feeler/planner/belief/noise.h"

namespace feeler::planner {

/// One outcome of a guarded move in a noisy world: cells advanced and the contact flag, which may be false although the
/// tool fell short.
struct NoisyOutcome {
  Outcome outcome;
  double probability = 0.0;
};

/// What a guarded move of `cells` does when the tool has `room` free cells before it (at most `cells`; fewer: then the
/// next step is blocked).
struct NoisyMove {
  std::vector<NoisyOutcome> outcomes;  ///< possible ones, fewer cells first, without contact before with
  double steps = 0.0;                  ///< expected steps made or spent in vain; the step that reports contact is none
  double contact = 0.0;                ///< probability that contact is reported
  double Cost(const CostWeights& cost, Direction direction) const {
    return cost.PerCell(AxisOf(direction)) * steps + cost.per_contact * contact + cost.per_action;
  }
};

/// The outcomes of guarded moves under a noise, by recursion over steps: worked out when first asked for. Not for more
/// than one thread.
class NoisyMoves {
 public:
  explicit NoisyMoves(const Noise& noise) : noise_(noise) {}
  const NoisyMove& Of(int cells, int room);

 private:
  Noise noise_;
  std::map<std::pair<int, int>, NoisyMove> moves_;
};

}  // namespace feeler::planner
