#include "feeler/planner/pomdp/model/belief_update.h"

#include <algorithm>

namespace feeler::planner {

void BeliefUpdate::Collect(std::span<const SparseEntry> belief, std::size_t action) {
  moved_.clear();
  seen_.clear();
  for (const SparseEntry& s : belief) {
    for (const SparseEntry& next : pomdp_.transitions.Row(pomdp_.At(action, s.index))) {
      moved_.push_back({next.index, s.value * next.value});
    }
  }
  std::ranges::stable_sort(moved_, {}, &SparseEntry::index);
  for (std::size_t i = 0; i < moved_.size();) {
    const std::uint32_t to = moved_[i].index;
    double probability = 0.0;
    for (; i < moved_.size() && moved_[i].index == to; ++i) probability += moved_[i].value;
    for (const SparseEntry& o : pomdp_.observation_rows.Row(pomdp_.At(action, to))) {
      if (parts_[o.index].empty()) seen_.push_back(o.index);
      parts_[o.index].push_back({to, probability * o.value});
    }
  }
  std::ranges::sort(seen_);
}

}  // namespace feeler::planner
