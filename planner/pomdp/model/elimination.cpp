#include "feeler/planner/pomdp/model/elimination.h"

#include <algorithm>
#include <queue>
#include <tuple>

namespace feeler::planner {
namespace {

/// 16 bytes each.
constexpr std::size_t kMostEntries = 20'000'000;

class Eliminator {
 public:
  Eliminator(const SparseRows& rows, const std::vector<double>& to_goal, const std::vector<double>& cost)
      : rows_(rows.size()), before_(rows.size()), to_goal_(to_goal), at_(rows.size(), kNone), gone_(rows.size(), 0) {
    result_.cost = cost;
    result_.steps.assign(rows.size(), 1.0);
    for (std::uint32_t i = 0; i < rows.size(); ++i) {
      for (const SparseEntry& next : rows.Row(i)) Add(i, next.index, next.value);
      for (const SparseEntry& next : rows_[i]) at_[next.index] = kNone;
    }
  }

  std::optional<EliminationResult> Run(Pulse& pulse) {
    for (std::uint32_t i = 0; i < rows_.size(); ++i) queue_.emplace(Price(i), i);
    std::vector<std::uint32_t> order;
    while (!queue_.empty()) {
      const auto [price, k] = queue_.top();
      queue_.pop();
      if (gone_[k] != 0) continue;
      if (price < Price(k)) {
        queue_.emplace(Price(k), k);
        continue;
      }
      if (entries_ > kMostEntries) return std::nullopt;
      TakeOut(k, pulse);
      order.push_back(k);
    }
    for (std::size_t n = order.size(); n-- > 0;) {
      const std::uint32_t k = order[n];
      for (const SparseEntry& next : rows_[k]) {
        result_.cost[k] += next.value * result_.cost[next.index];
        result_.steps[k] += next.value * result_.steps[next.index];
      }
      result_.cost[k] /= Leaves(k);
      result_.steps[k] /= Leaves(k);
    }
    return std::move(result_);
  }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  std::size_t Price(std::uint32_t k) const { return rows_[k].size() * before_[k].size(); }
  double Leaves(std::uint32_t k) const {
    double sum = to_goal_[k];
    for (const SparseEntry& next : rows_[k]) sum += next.value;
    return sum;
  }

  /// Adds to an entry of row i, whose entries stand at at_.
  void Add(std::uint32_t i, std::uint32_t to, double value) {
    if (at_[to] == kNone) {
      at_[to] = static_cast<std::uint32_t>(rows_[i].size());
      rows_[i].push_back({to, 0.0});
      before_[to].push_back(i);
      ++entries_;
    }
    rows_[i][at_[to]].value += value;
  }

  void TakeOut(std::uint32_t k, Pulse& pulse) {
    gone_[k] = 1;
    const double leaves = Leaves(k);
    for (const std::uint32_t i : before_[k]) {
      if (gone_[i] != 0) continue;
      std::vector<SparseEntry>& row = rows_[i];
      const auto found = std::ranges::find(row, k, &SparseEntry::index);
      if (found == row.end()) continue;
      const double share = found->value / leaves;
      *found = row.back();
      row.pop_back();
      pulse(3 * (row.size() + rows_[k].size()) + 10);
      for (std::uint32_t at = 0; at < row.size(); ++at) at_[row[at].index] = at;
      for (const SparseEntry& next : rows_[k]) {
        if (next.index != i) Add(i, next.index, share * next.value);
      }
      for (const SparseEntry& next : row) at_[next.index] = kNone;
      to_goal_[i] += share * to_goal_[k];
      result_.cost[i] += share * result_.cost[k];
      result_.steps[i] += share * result_.steps[k];
    }
    before_[k] = {};
  }

  std::vector<std::vector<SparseEntry>> rows_;
  std::vector<std::vector<std::uint32_t>> before_;  ///< rows that lead to a state, those taken out too
  std::vector<double> to_goal_;
  std::vector<std::uint32_t> at_;  ///< by state; kNone between uses
  std::vector<std::uint8_t> gone_;
  std::priority_queue<std::tuple<std::size_t, std::uint32_t>, std::vector<std::tuple<std::size_t, std::uint32_t>>,
                      std::greater<>>
      queue_;
  std::size_t entries_ = 0;
  EliminationResult result_;
};

}  // namespace

std::optional<EliminationResult> EliminateStates(const SparseRows& rows, const std::vector<double>& to_goal,
                                                 const std::vector<double>& cost, Pulse& pulse) {
  return Eliminator(rows, to_goal, cost).Run(pulse);
}

}  // namespace feeler::planner
