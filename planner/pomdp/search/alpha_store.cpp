#include "feeler/planner/pomdp/search/alpha_store.h"

#include <algorithm>
#include <numeric>

namespace feeler::planner {

std::uint32_t AlphaStore::Add(AlphaVector vector) {
  for (const std::uint32_t other : active_) {
    if (dropped_[other] != 0) continue;
    const std::vector<double>& values = vectors_[other].values;
    bool dominated = true;
    for (std::size_t i = 0; i < values.size() && dominated; ++i) dominated = values[i] <= vector.values[i];
    if (dominated) dropped_[other] = 1;
  }
  const double sum = std::accumulate(vector.values.begin(), vector.values.end(), 0.0);
  const auto number = static_cast<std::uint32_t>(vectors_.size());
  if (sum > fallback_sum_) {
    fallback_sum_ = sum;
    fallback_ = number;
  }
  bytes_ +=
      sizeof(AlphaVector) + vector.values.size() * sizeof(double) + vector.next.size() * sizeof(std::uint32_t) + 8;
  vectors_.push_back(std::move(vector));
  dropped_.push_back(0);
  active_.push_back(number);
  return number;
}

double AlphaStore::Advance(std::span<const SparseEntry> belief, Cursor& cursor) const {
  if (cursor.epoch != epoch_) cursor = {epoch_, 0, kNone};
  double best = -std::numeric_limits<double>::infinity();
  // What has been found stays the best unless something new beats it.
  const auto value = [&](std::uint32_t number) {
    const double* values = vectors_[number].values.data();
    double sum = 0.0;
    for (const SparseEntry& s : belief) sum += s.value * values[s.index];
    return sum;
  };
  if (cursor.seen == active_.size()) return best;
  if (cursor.best != kNone) best = value(cursor.best);
  for (; cursor.seen < active_.size(); ++cursor.seen) {
    const std::uint32_t number = active_[cursor.seen];
    if (dropped_[number] != 0) continue;
    const double here = value(number);
    if (here <= best && cursor.best != kNone) continue;
    best = here;
    cursor.best = number;
  }
  return best;
}

void AlphaStore::Keep(const std::vector<std::uint8_t>& marked) {
  std::erase_if(active_, [&](std::uint32_t number) {
    const bool drop = dropped_[number] != 0 || (marked[number] == 0 && number != fallback_);
    if (drop) dropped_[number] = 1;
    return drop;
  });
  kept_ = active_.size();
  ++epoch_;
}

}  // namespace feeler::planner
