#include "feeler/planner/pomdp/model/belief_update.h"

#include <algorithm>

namespace feeler::planner {

void BeliefUpdate::Collect(std::span<const SparseEntry> belief, std::size_t action) {
  moved_.clear();
  seen_.clear();
  constexpr std::size_t kEntryWork = 20;
  const auto tell = [&](std::size_t entries) {
    if (pulse_ != nullptr) (*pulse_)(kEntryWork * entries);
  };
  for (const SparseEntry& s : belief) {
    const auto row = pomdp_.transitions.Row(pomdp_.At(action, s.index));
    tell(row.size());
    for (const SparseEntry& next : row) {
      moved_.push_back({next.index, s.value * next.value});
    }
  }
  std::ranges::stable_sort(moved_, {}, &SparseEntry::index);
  for (std::size_t i = 0; i < moved_.size();) {
    const std::uint32_t to = moved_[i].index;
    double probability = 0.0;
    for (; i < moved_.size() && moved_[i].index == to; ++i) probability += moved_[i].value;
    const auto observations = pomdp_.observation_rows.Row(pomdp_.At(action, to));
    tell(observations.size());
    for (const SparseEntry& o : observations) {
      if (parts_[o.index].empty()) seen_.push_back(o.index);
      parts_[o.index].push_back({to, probability * o.value});
    }
  }
  std::ranges::sort(seen_);
}

}  // namespace feeler::planner
