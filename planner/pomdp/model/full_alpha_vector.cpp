#include "feeler/planner/pomdp/model/full_alpha_vector.h"

#include <algorithm>
#include <limits>

namespace feeler::planner {

std::uint32_t BestAction(const std::vector<FullAlphaVector>& alphas, std::span<const SparseEntry> belief) {
  std::uint32_t action = 0;
  double best = -std::numeric_limits<double>::infinity();
  for (const FullAlphaVector& alpha : alphas) {
    // Both ascending by state.
    double value = 0.0;
    auto at = alpha.values.begin();
    for (const SparseEntry& s : belief) {
      at = std::ranges::lower_bound(at, alpha.values.end(), s.index, {}, &SparseEntry::index);
      value += s.value * (at != alpha.values.end() && at->index == s.index ? at->value : alpha.elsewhere);
    }
    if (value > best) best = value, action = alpha.action;
  }
  return action;
}

}  // namespace feeler::planner
