#include "feeler/planner/pomdp/model/state_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "feeler/planner/pomdp/model/goal_costs.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {
namespace {

constexpr double kNoBound = std::numeric_limits<double>::infinity();

using Rows = std::vector<std::vector<double>>;

class Sweeper {
 public:
  Sweeper(const Pomdp& pomdp, const StateBoundsOptions& options)
      : pomdp_(pomdp), options_(options), pulse_(options.stop) {
    for (const double r : pomdp.reward) {
      least_ = std::min(least_, r);
      most_ = std::max(most_, r);
    }
  }

  StateBounds Run() {
    const std::size_t states = pomdp_.state_count();
    const std::size_t actions = pomdp_.action_count();
    // Above every value: the best reward for ever; nothing is above 0 in goal POMDPs.
    const double above = pomdp_.discount < 1.0 ? most_ / (1.0 - pomdp_.discount) : 0.0;
    const double below = pomdp_.discount < 1.0 ? least_ / (1.0 - pomdp_.discount) : -kNoBound;
    scale_ = std::max({1e-9, std::abs(above), std::isfinite(below) ? std::abs(below) : std::abs(least_)});

    StateBounds bounds;
    std::vector<double> best(states, above);
    bounds.qmdp.assign(actions, std::vector<double>(states, above));
    Repeat([&] { return SweepMdp(best, bounds.qmdp); });
    bounds.informed = bounds.qmdp;
    Repeat([&] { return SweepInformed(bounds.informed); });
    bounds.blind.assign(actions, std::vector<double>(states, below));
    if (pomdp_.discount < 1.0) {
      for (std::size_t a = 0; a < actions; ++a) {
        Repeat([&] { return SweepBlind(a, bounds.blind[a]); });
      }
    } else {
      for (std::size_t a = 0; a < actions; ++a) BlindToGoal(a, bounds.blind[a]);
    }
    return bounds;
  }

 private:
  template <class Sweep>
  void Repeat(Sweep sweep) {
    try {
      for (int i = 0; i < options_.sweeps; ++i) {
        if (sweep() <= options_.precision * scale_) return;
      }
    } catch (const Interrupted&) {
      // Every value is a bound at any time.
    }
  }

  double Backup(std::size_t a, std::size_t s, const std::vector<double>& values) {
    double sum = 0.0;
    const std::span<const SparseEntry> row = pomdp_.transitions.Row(pomdp_.At(a, s));
    pulse_(row.size() + 5);
    for (const SparseEntry& next : row) sum += next.value * values[next.index];
    return pomdp_.reward[pomdp_.At(a, s)] + pomdp_.discount * sum;
  }

  /// In place (Gauss-Seidel): values only fall, and stay above V*.
  double SweepMdp(std::vector<double>& best, Rows& q) {
    double change = 0.0;
    for (std::size_t s = 0; s < best.size(); ++s) {
      double most = -kNoBound;
      for (std::size_t a = 0; a < q.size(); ++a) most = std::max(most, q[a][s] = std::min(q[a][s], Backup(a, s, best)));
      change = std::max(change, best[s] - most);
      best[s] = std::min(best[s], most);
    }
    return change;
  }

  /// Q(a, s) = R(a, s) + gamma sum_o max_a' sum_s' P(s', o | s, a) Q(a', s').
  double SweepInformed(Rows& q) {
    double change = 0.0;
    std::vector<std::uint32_t> seen;
    sums_.assign(pomdp_.observation_count() * q.size(), 0.0);
    for (std::size_t s = 0; s < pomdp_.state_count(); ++s) {
      for (std::size_t a = 0; a < q.size(); ++a) {
        seen.clear();
        for (const SparseEntry& next : pomdp_.transitions.Row(pomdp_.At(a, s))) {
          for (const SparseEntry& o : pomdp_.observation_rows.Row(pomdp_.At(a, next.index))) {
            double* sum = sums_.data() + o.index * q.size();
            pulse_(q.size() + 5);
            seen.push_back(o.index);
            for (std::size_t then = 0; then < q.size(); ++then) sum[then] += next.value * o.value * q[then][next.index];
          }
        }
        double total = 0.0;
        std::ranges::sort(seen);
        seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
        for (const std::uint32_t o : seen) {
          double* sum = sums_.data() + o * q.size();
          total += *std::max_element(sum, sum + q.size());
          std::fill(sum, sum + q.size(), 0.0);
        }
        const double value = std::min(q[a][s], pomdp_.reward[pomdp_.At(a, s)] + pomdp_.discount * total);
        change = std::max(change, q[a][s] - value);
        q[a][s] = value;
      }
    }
    return change;
  }

  double SweepBlind(std::size_t a, std::vector<double>& values) {
    double change = 0.0;
    for (std::size_t s = 0; s < values.size(); ++s) {
      const double value = std::max(values[s], Backup(a, s, values));
      change = std::max(change, value - values[s]);
      values[s] = value;
    }
    return change;
  }

  void BlindToGoal(std::size_t a, std::vector<double>& values) const {
    if (options_.stop && options_.stop()) return;
    GoalChain chain;
    chain.goal = AbsorbingStates(pomdp_);
    for (std::size_t s = 0; s < values.size(); ++s) {
      chain.rows.Append(pomdp_.transitions.Row(pomdp_.At(a, s)));
      chain.cost.push_back(std::max(0.0, -pomdp_.reward[pomdp_.At(a, s)]));
    }
    const auto costs = GoalCosts(chain, options_.stop);
    for (std::size_t s = 0; costs && s < values.size(); ++s) values[s] = -(*costs)[s];
  }

  const Pomdp& pomdp_;
  const StateBoundsOptions& options_;
  Pulse pulse_;
  double least_ = 0.0, most_ = -kNoBound;
  double scale_ = 1.0;
  std::vector<double> sums_;
};

}  // namespace

StateBounds ComputeStateBounds(const Pomdp& pomdp, const StateBoundsOptions& options) {
  return Sweeper(pomdp, options).Run();
}

double BestRow(const std::vector<std::vector<double>>& rows, std::span<const SparseEntry> belief) {
  double best = -kNoBound;
  for (const std::vector<double>& row : rows) {
    double sum = 0.0;
    for (const SparseEntry& s : belief) sum += s.value * row[s.index];
    best = std::max(best, sum);
  }
  return best;
}

}  // namespace feeler::planner
