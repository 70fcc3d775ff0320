#include "feeler/planner/pomdp/model/goal_costs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "feeler/planner/pomdp/model/elimination.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {
namespace {

constexpr double kGoalPrecision = 1e-12;
constexpr int kSweepsBeforeElimination = 300;
constexpr int kGoalSweeps = 100000;
constexpr std::size_t kMostEliminated = 20000;

/// Marks all that can come to what is marked.
void SpreadBackwards(const GoalChain& chain, std::vector<std::uint8_t>& marked) {
  const std::size_t count = marked.size();
  std::vector<std::size_t> begin(count + 1, 0);
  const auto row = [&](std::size_t i) {
    return chain.goal[i] != 0 ? std::span<const SparseEntry>() : chain.rows.Row(i);
  };
  for (std::size_t i = 0; i < count; ++i) {
    for (const SparseEntry& next : row(i)) ++begin[next.index + 1];
  }
  for (std::size_t i = 0; i < count; ++i) begin[i + 1] += begin[i];
  std::vector<std::uint32_t> from(begin[count]);
  std::vector<std::size_t> at(begin.begin(), begin.end() - 1);
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const SparseEntry& next : row(i)) from[at[next.index]++] = i;
  }
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (marked[i] != 0) open.push_back(i);
  }
  while (!open.empty()) {
    const std::uint32_t to = open.back();
    open.pop_back();
    for (std::size_t k = begin[to]; k < begin[to + 1]; ++k) {
      if (marked[from[k]] == 0) marked[from[k]] = 1, open.push_back(from[k]);
    }
  }
}

/// (I - P) w = cost and (I - P) steps = 1 over the states that come to a goal for certain.
class GoalSystem {
 public:
  GoalSystem(const GoalChain& chain, const std::vector<std::uint8_t>& lost) {
    constexpr std::uint32_t kNone = ~std::uint32_t{0};
    std::vector<std::uint32_t> number(chain.goal.size(), kNone);
    for (std::uint32_t i = 0; i < number.size(); ++i) {
      if (chain.goal[i] != 0 || lost[i] != 0) continue;
      number[i] = static_cast<std::uint32_t>(states_.size());
      states_.push_back(i);
    }
    std::vector<SparseEntry> row;
    for (std::uint32_t i = 0; i < states_.size(); ++i) {
      row.clear();
      double leaves = 0.0;  // summed up itself: 1 - what stays would be rounding where that is almost 1
      double to_goal = 0.0;
      for (const SparseEntry& next : chain.rows.Row(states_[i])) {
        if (number[next.index] == i) continue;
        leaves += next.value;
        if (number[next.index] != kNone) {
          row.push_back({number[next.index], next.value});
        } else {
          to_goal += next.value;
        }
      }
      leaves_.push_back(leaves);
      to_goal_.push_back(to_goal);
      rows_.Append(row);
      cost_.push_back(chain.cost[states_[i]]);
    }
    values_.assign(states_.size(), 0.0);
    steps_ = values_;
  }

  void Solve(const std::function<bool()>& stop) {
    Pulse pulse(stop);
    try {
      for (int sweep = 0; sweep < kGoalSweeps; ++sweep) {
        if (Sweep(pulse)) return;
        if (sweep == kSweepsBeforeElimination && states_.size() <= kMostEliminated && Eliminate(pulse)) return;
      }
    } catch (const Interrupted&) {
      // Bound() says what the sweeps have come to.
    }
  }

  /// Adds what the residuals may amount to. False where the sweeps have not come far enough to say.
  bool Bound(std::vector<double>& costs) const {
    double residual = 0.0;
    double residual_steps = 0.0;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      residual = std::max(residual, Residual(i, cost_[i], values_));
      residual_steps = std::max(residual_steps, Residual(i, 1.0, steps_));
    }
    if (!(residual_steps <= 0.5)) return false;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      costs[states_[i]] = values_[i] + residual * steps_[i] / (1.0 - residual_steps);
    }
    return std::ranges::all_of(states_, [&](std::uint32_t i) { return std::isfinite(costs[i]); });
  }

 private:
  double Residual(std::size_t i, double cost, const std::vector<double>& values) const {
    double sum = cost - leaves_[i] * values[i];
    for (const SparseEntry& next : rows_.Row(i)) sum += next.value * values[next.index];
    return sum;
  }

  /// True if nothing changes any more. Backwards: successors come after what leads to them, mostly.
  bool Sweep(Pulse& pulse) {
    double change = 0.0;
    for (std::size_t i = states_.size(); i-- > 0;) {
      pulse(2 * rows_.Row(i).size() + 20);
      double value = cost_[i];
      double steps = 1.0;
      for (const SparseEntry& next : rows_.Row(i)) {
        value += next.value * values_[next.index];
        steps += next.value * steps_[next.index];
      }
      value /= leaves_[i];
      steps /= leaves_[i];
      change = std::max({change, (value - values_[i]) / std::max(1.0, value), (steps - steps_[i]) / steps});
      values_[i] = value;
      steps_[i] = steps;
    }
    return change <= kGoalPrecision;
  }

  /// False where it would take too much memory.
  bool Eliminate(Pulse& pulse) {
    const auto solved = EliminateStates(rows_, to_goal_, cost_, pulse);
    if (!solved) return false;
    values_ = solved->cost;
    steps_ = solved->steps;
    return true;
  }

  std::vector<std::uint32_t> states_;
  SparseRows rows_;
  std::vector<double> leaves_, to_goal_, cost_;
  std::vector<double> values_, steps_;
};

}  // namespace

std::optional<std::vector<double>> GoalCosts(const GoalChain& chain, const std::function<bool()>& stop) {
  std::vector<std::uint8_t> lost = chain.goal;
  SpreadBackwards(chain, lost);
  for (std::uint8_t& mark : lost) mark = mark != 0 ? 0 : 1;  // cannot come to a goal
  SpreadBackwards(chain, lost);
  std::vector<double> costs(chain.goal.size(), 0.0);
  for (std::size_t i = 0; i < costs.size(); ++i) {
    if (lost[i] != 0) costs[i] = std::numeric_limits<double>::infinity();
  }
  GoalSystem system(chain, lost);
  system.Solve(stop);
  if (!system.Bound(costs)) return std::nullopt;
  return costs;
}

}  // namespace feeler::planner
