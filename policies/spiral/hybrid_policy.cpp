#include "feeler/policies/spiral/hybrid_policy.h"

#include <cassert>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/policies/spiral/spiral_policy.h"

namespace feeler::policies {

HybridPolicy::HybridPolicy(std::unique_ptr<Policy> spiral, std::unique_ptr<Policy> touch, Direction insertion,
                           double cell_m, double threshold_m)
    : spiral_(std::move(spiral)),
      touch_(std::move(touch)),
      insertion_(insertion),
      cell_m_(cell_m),
      threshold_m_(threshold_m),
      chosen_(touch_.get()) {
  assert(spiral_ && touch_);
  if (!(threshold_m >= 0.0)) throw InputError("hybrid", "the threshold is negative or no number", "give it in metres");
}

void HybridPolicy::Begin(const planner::Problem& problem) {
  Eigen::Vector3d half_m = HalfWidths(problem.hypotheses, cell_m_);
  half_m[AxisOf(insertion_)] = 0.0;
  chosen_ = half_m.maxCoeff() < threshold_m_ ? spiral_.get() : touch_.get();
  chosen_->Begin(problem);
}

}  // namespace feeler::policies
