#include "feeler/planner/pomdp/files/table_builder.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace feeler::planner {

void RowsBuilder::Set(std::size_t row, std::uint32_t column, double value, int line) {
  rows_[row].push_back({column, value});
  lines_[row] = line;
  ++entries_;
}

void RowsBuilder::Fill(std::size_t row, double value, int line) {
  entries_ -= rows_[row].size();
  rows_[row].clear();
  lines_[row] = line;
  if (value == 0.0) return;
  for (std::size_t column = 0; column < columns_; ++column) {
    rows_[row].push_back({static_cast<std::uint32_t>(column), value});
  }
  entries_ += columns_;
}

void RowsBuilder::Assign(std::size_t row, std::vector<SparseEntry> entries, int line) {
  entries_ -= rows_[row].size();
  entries_ += entries.size();
  rows_[row] = std::move(entries);
  lines_[row] = line;
}

SparseRows RowsBuilder::Finish(const std::function<void(std::size_t, double, int)>& fail, Pulse& pulse) {
  SparseRows finished;
  std::vector<SparseEntry> kept;
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    std::vector<SparseEntry>& entries = rows_[row];
    pulse(20 * entries.size() + 10);
    std::ranges::stable_sort(entries, {}, &SparseEntry::index);
    kept.clear();
    double sum = 0.0;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const bool overridden = i + 1 < entries.size() && entries[i + 1].index == entries[i].index;
      if (overridden || entries[i].value == 0.0) continue;
      kept.push_back(entries[i]);
      sum += entries[i].value;
    }
    if (!(std::abs(sum - 1.0) <= kSumTolerance)) fail(row, sum, lines_[row]);
    for (SparseEntry& entry : kept) entry.value /= sum;
    finished.Append(kept);
    std::vector<SparseEntry>().swap(entries);
  }
  return finished;
}

std::uint64_t RewardStatements::Key(std::uint32_t a, std::uint32_t s, std::uint32_t next, std::uint32_t o) const {
  // Any is 0, since kAny + 1 is.
  std::uint64_t key = std::uint32_t{a + 1};
  key = key * (states_ + 1) + std::uint32_t{s + 1};
  key = key * (states_ + 1) + std::uint32_t{next + 1};
  return key * (observations_ + 1) + std::uint32_t{o + 1};
}

void RewardStatements::Set(std::uint32_t action, std::uint32_t from, std::uint32_t to, std::uint32_t observation,
                           double value) {
  statements_[Key(action, from, to, observation)] = {value, ++order_};
  const unsigned detail = (to == kAny ? 0U : 1U) | (observation == kAny ? 0U : 2U);
  if (detail != 0) detail_[Key(action, from, kAny, kAny)] |= detail;
  const auto given = [](std::uint32_t index, unsigned bit) { return index == kAny ? 0U : 1U << bit; };
  patterns_[given(action, 0) | given(from, 1) | given(to, 2) | given(observation, 3)] = true;
}

double RewardStatements::Find(std::uint32_t a, std::uint32_t s, std::uint32_t next, std::uint32_t o) const {
  Statement last;
  for (unsigned pattern = 0; pattern < 16; ++pattern) {
    if (!patterns_[pattern]) continue;
    const auto pick = [&](std::uint32_t index, unsigned bit) { return (pattern >> bit & 1U) != 0 ? index : kAny; };
    const auto found = statements_.find(Key(pick(a, 0), pick(s, 1), pick(next, 2), pick(o, 3)));
    if (found != statements_.end() && found->second.order > last.order) last = found->second;
  }
  return last.value;
}

unsigned RewardStatements::Detail(std::uint32_t a, std::uint32_t s) const {
  unsigned detail = 0;
  if (detail_.empty()) return detail;
  for (const std::uint32_t action : {a, kAny}) {
    for (const std::uint32_t state : {s, kAny}) {
      const auto found = detail_.find(Key(action, state, kAny, kAny));
      if (found != detail_.end()) detail |= found->second;
    }
  }
  return detail;
}

std::vector<double> RewardStatements::Expected(const SparseRows& transitions, const SparseRows& observation_rows,
                                               Pulse& pulse) const {
  const auto look = [&] { pulse(10 + 20 * static_cast<std::size_t>(std::ranges::count(patterns_, true))); };
  std::vector<double> expected(actions_ * states_, 0.0);
  for (std::uint32_t a = 0; a < actions_; ++a) {
    for (std::uint32_t s = 0; s < states_; ++s) {
      double& sum = expected[a * states_ + s];
      look();
      const unsigned detail = Detail(a, s);
      if (detail == 0) {
        sum = Find(a, s, 0, 0);
        continue;
      }
      for (const SparseEntry& next : transitions.Row(a * states_ + s)) {
        look();
        if ((detail & 2U) == 0) {
          sum += next.value * Find(a, s, next.index, 0);
          continue;
        }
        for (const SparseEntry& o : observation_rows.Row(a * states_ + next.index)) {
          look();
          sum += next.value * o.value * Find(a, s, next.index, o.index);
        }
      }
    }
  }
  return expected;
}

}  // namespace feeler::planner
