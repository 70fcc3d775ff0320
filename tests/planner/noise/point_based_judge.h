#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <queue>
#include <stdexcept>
#include <utility>
#include <vector>

#include "feeler/planner/belief/lattice_problem.h"

namespace feeler::planner::testing {

/// An independent solver of noisy lattice problems (docs/planner.md, "Noise"), from the data of the file alone: it
/// shares no code with the planner. Heuristic search value iteration (Smith and Simmons 2004) for costs, on the relaxed
/// problem in which one hypothesis may be declared at any probability and costs W if it is wrong.
///
/// Moves of one cell alone: without costs of actions they are enough, since a longer move does the same attempts and
/// tells less of them.
///
/// V of a robot's cell, over weights w of the hypotheses that need not sum to 1, is the least of functions linear in w
/// (one a plan). Upper bounds: such functions, of plans that are known. Lower bounds: V(u + v) >= V(u) + V(v), so that
/// a point w' of known bound L' gives V(w) >= s L' + V(w - s w') for every s w' <= w.
class PointBasedJudge {
 public:
  struct Interval {
    double lower = 0.0;
    double upper = 0.0;
  };

  PointBasedJudge(const LatticeProblemData& data, const Noise& noise, double wrong_cost)
      : data_(data), noise_(noise), wrong_(wrong_cost), n_(data.hypotheses.size()) {
    if (data.cost.per_action != 0.0 || !data.cost.one_per_cell() || data.goal != GoalKind::kSingleton) {
      throw std::invalid_argument("not for these costs or goals");
    }
    for (int x = 0; x < data.size.x(); ++x) {
      for (int y = 0; y < data.size.y(); ++y) {
        for (int z = 0; z < data.size.z(); ++z) cells_.emplace_back(x, y, z);
      }
    }
    LookAround();
    CutIntoGroups();
    at_.resize(cells_.size());
    double sum = 0.0;
    for (const Hypothesis& h : data.hypotheses) sum += h.weight;
    for (const Hypothesis& h : data.hypotheses) start_.push_back(h.weight / sum);
  }

  /// Until U <= gap L at the start, or after so many trials.
  Interval Solve(double gap, int trials) {
    const std::size_t start = IndexOf(data_.start);
    Interval known{Lower(start, start_), Upper(start, start_).first};
    for (int trial = 0; trial < trials && known.upper > gap * known.lower; ++trial) {
      Trial(start, std::max((gap - 1.0) * known.lower, kTrialShare * (known.upper - known.lower)));
      known = {Lower(start, start_), Upper(start, start_).first};
    }
    return known;
  }
  std::size_t backups() const { return backups_; }

 private:
  using Weights = std::vector<double>;  ///< by hypothesis
  static constexpr int kOutside = -1;
  static constexpr double kTrialShare = 0.9;
  static constexpr std::size_t kLongestTrial = 400;
  static constexpr double kLeastChange = 1e-7;  ///< of a bound, as a share of W
  static constexpr double kTiny = 1e-8;         ///< less likely hypotheses are left out of trials
  static constexpr double kWorthTheRest = 0.5;
  static constexpr int kRounds = 3;
  static constexpr std::size_t kTableEntries = std::size_t{1} << 23;

  struct Point {
    std::vector<std::pair<std::size_t, double>> weights;  ///< of the hypotheses that it holds, rarest first
    double lower = 0.0;
  };
  struct Bounds {
    std::vector<Point> points;
    std::vector<Weights> plans;  ///< costs under each hypothesis
  };
  /// Some hypotheses, and for each subset of them a bound at each cell.
  struct Group {
    std::vector<std::size_t> members;
    std::vector<float> table;  ///< subset * cells + cell; subsets weigh 1 a member
  };
  /// What follows an attempt: the tool advances, contact is reported, the tool stays.
  struct Split {
    std::array<Weights, 3> parts;
    std::array<std::size_t, 3> cell{};
    double cost = 0.0;
    bool all_free = true, all_blocked = true;
  };

  std::size_t IndexOf(const Cell& c) const {
    return static_cast<std::size_t>((c.x() * data_.size.y() + c.y()) * data_.size.z() + c.z());
  }
  bool BlockedAt(std::size_t cell, std::size_t h) const { return blocked_[cell * n_ + h] != 0; }

  void LookAround() {
    blocked_.assign(cells_.size() * n_, 0);
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      for (std::size_t h = 0; h < n_; ++h) {
        for (const Cell& tool : data_.tool) {
          for (const Cell& target : data_.target) {
            if (cells_[c] + tool == target + data_.hypotheses[h].offset) blocked_[c * n_ + h] = 1;
          }
        }
      }
      std::array<int, 6> next{};
      for (std::size_t d = 0; d < 6; ++d) {
        Cell there = cells_[c];
        there[static_cast<int>(d / 2)] += d % 2 == 0 ? 1 : -1;
        const bool inside = (there.array() >= 0).all() && (there.array() < data_.size.array()).all();
        next[d] = inside ? static_cast<int>(IndexOf(there)) : kOutside;
      }
      next_.push_back(next);
    }
  }

  double FreeCost() const {
    return noise_.false_stop * data_.cost.per_contact + (1.0 - noise_.false_stop) * data_.cost.per_cell;
  }
  double BlockedCost() const {
    return (1.0 - noise_.missed_contact) * data_.cost.per_contact + noise_.missed_contact * data_.cost.per_cell;
  }
  double Advances() const { return 1.0 - noise_.false_stop - noise_.slip; }

  /// Lower bounds to begin with: a world in which the policy sees for nothing whether a step before it is blocked. What
  /// an attempt returns then tells nothing, a cell costs what attempts cost until one advances, and beliefs are the
  /// hypotheses that agree with what was seen. Solved over all subsets of groups of hypotheses, smaller ones first.
  void CutIntoGroups() {
    std::size_t most = 1;
    while (most < n_ && (cells_.size() << (most + 1)) <= kTableEntries) ++most;
    const std::size_t count = (n_ + most - 1) / most;
    for (std::size_t g = 0; g < count; ++g) {
      Group group;
      for (std::size_t h = g * n_ / count; h < (g + 1) * n_ / count; ++h) group.members.push_back(h);
      group.table.assign(cells_.size() << group.members.size(), 0.0F);
      for (std::size_t subset = 1; subset < std::size_t{1} << group.members.size(); ++subset) Tell(group, subset);
      groups_.push_back(std::move(group));
    }
  }

  /// The least cost of telling a subset's members apart, from every cell: shortest paths to where it splits.
  void Tell(Group& group, std::size_t subset) {
    const auto size = static_cast<double>(std::popcount(subset));
    if (size < 2.0) return;
    const double step = size * FreeCost() / Advances();
    const std::size_t cells = cells_.size();
    std::vector<std::uint32_t> walls(cells, 0);  // members under which the cell is blocked
    for (std::size_t c = 0; c < cells; ++c) {
      for (std::size_t i = 0; i < group.members.size(); ++i) {
        if ((subset >> i & 1U) != 0 && BlockedAt(c, group.members[i])) walls[c] |= std::uint32_t{1} << i;
      }
    }
    std::vector<double> cost(cells, wrong_ * (size - 1.0));
    std::priority_queue<std::pair<double, std::size_t>, std::vector<std::pair<double, std::size_t>>, std::greater<>>
        queue;
    for (std::size_t c = 0; c < cells; ++c) {
      if (walls[c] != 0) continue;
      for (const int next : next_[c]) {
        if (next == kOutside) continue;
        const std::size_t there = walls[static_cast<std::size_t>(next)];
        if (there == 0 || there == subset) continue;
        cost[c] =
            std::min<double>(cost[c], group.table[there * cells + c] + group.table[(subset & ~there) * cells + c]);
      }
      if (cost[c] < wrong_ * (size - 1.0)) queue.emplace(cost[c], c);
    }
    while (!queue.empty()) {
      const auto [least, c] = queue.top();
      queue.pop();
      if (least > cost[c]) continue;
      for (const int next : next_[c]) {
        if (next == kOutside || walls[static_cast<std::size_t>(next)] != 0) continue;
        double& its = cost[static_cast<std::size_t>(next)];
        if (least + step >= its) continue;
        its = least + step;
        queue.emplace(its, next);
      }
    }
    constexpr double kRounding = 1.0 - 1e-6;
    for (std::size_t c = 0; c < cells; ++c) group.table[subset * cells + c] = static_cast<float>(kRounding * cost[c]);
  }

  /// Weights are a sum of subsets of equal weight, {h : w(h) >= t} over t, and of groups.
  double FromGroups(std::size_t cell, const Weights& weights) const {
    double sum = 0.0;
    auto& order = order_;
    for (const Group& group : groups_) {
      order.clear();
      for (std::size_t i = 0; i < group.members.size(); ++i) {
        if (weights[group.members[i]] > 0.0) order.emplace_back(weights[group.members[i]], i);
      }
      std::ranges::sort(order, std::greater<>());
      std::size_t subset = 0;
      for (std::size_t k = 0; k < order.size(); ++k) {
        subset |= std::size_t{1} << order[k].second;
        const double below = k + 1 < order.size() ? order[k + 1].first : 0.0;
        sum += (order[k].first - below) * group.table[subset * cells_.size() + cell];
      }
    }
    return sum;
  }

  /// The largest s with s times the point's weights in `weights`; 0 where s times its bound is not above `least`.
  static double ShareIn(const Point& point, const Weights& weights, double least) {
    double share = std::numeric_limits<double>::infinity();
    for (const auto& [h, weight] : point.weights) {
      share = std::min(share, weights[h] / weight);
      if (share * point.lower <= least) return 0.0;
    }
    return share;
  }

  /// Takes the point that bounds most out of the weights, then what does for the rest.
  double Lower(std::size_t cell, Weights weights) const {
    double sum = 0.0;
    for (int round = 0; round < kRounds; ++round) {
      double best = FromGroups(cell, weights);
      const Point* taken = nullptr;
      double part = 0.0;
      for (const Point& point : at_[cell].points) {
        const double share = ShareIn(point, weights, kWorthTheRest * best);
        if (share == 0.0) continue;
        rest_ = weights;
        for (const auto& [h, weight] : point.weights) rest_[h] = std::max(0.0, rest_[h] - share * weight);
        const double bound = share * point.lower + FromGroups(cell, rest_);
        if (bound > best) best = bound, taken = &point, part = share;
      }
      if (taken == nullptr) return sum + best;
      sum += part * taken->lower;
      for (const auto& [h, weight] : taken->weights) weights[h] = std::max(0.0, weights[h] - part * weight);
    }
    return sum + FromGroups(cell, weights);
  }

  /// With the plan: its number, or -1 - h for the declaration of h.
  std::pair<double, int> Upper(std::size_t cell, const Weights& weights) const {
    const auto likeliest = std::ranges::max_element(weights);
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    std::pair<double, int> best{wrong_ * (sum - *likeliest), -1 - static_cast<int>(likeliest - weights.begin())};
    const std::vector<Weights>& plans = at_[cell].plans;
    for (std::size_t i = 0; i < plans.size(); ++i) {
      const double cost = std::inner_product(weights.begin(), weights.end(), plans[i].begin(), 0.0);
      if (cost < best.first) best = {cost, static_cast<int>(i)};
    }
    return best;
  }
  double CostOf(std::size_t cell, int plan, std::size_t h) const {
    if (plan < 0) return static_cast<std::size_t>(-1 - plan) == h ? 0.0 : wrong_;
    return at_[cell].plans[static_cast<std::size_t>(plan)][h];
  }

  Split Attempt(std::size_t cell, const Weights& weights, std::size_t d) const {
    const auto next = static_cast<std::size_t>(next_[cell][d]);
    Split split;
    split.parts.fill(Weights(n_, 0.0));
    split.cell = {next, cell, cell};
    for (std::size_t h = 0; h < n_; ++h) {
      if (weights[h] <= 0.0) continue;
      const bool blocked = BlockedAt(next, h);
      (blocked ? split.all_free : split.all_blocked) = false;
      split.cost += weights[h] * (blocked ? BlockedCost() : FreeCost());
      split.parts[0][h] = blocked ? 0.0 : weights[h] * Advances();
      split.parts[1][h] = weights[h] * (blocked ? 1.0 - noise_.missed_contact : noise_.false_stop);
      split.parts[2][h] = weights[h] * (blocked ? noise_.missed_contact : noise_.slip);
    }
    return split;
  }

  /// Cost of an attempt and of what `bound(cell, weights)` says for its parts; where it tells nothing it is repeated
  /// until the tool advances.
  template <class Bound>
  double Sum(const Split& split, Bound bound) const {
    double sum = split.cost;
    for (std::size_t o = 0; o < (split.all_free ? 1U : 3U); ++o) sum += bound(split.cell[o], split.parts[o]);
    return split.all_free ? sum / Advances() : sum;
  }

  /// Backs up both bounds at a belief; returns the direction of the least lower bound (-1: to declare).
  int Backup(std::size_t cell, const Weights& weights) {
    ++backups_;
    const double declared = wrong_ * (1.0 - *std::ranges::max_element(weights));
    std::array<Split, 6> splits;
    std::array<double, 7> lower{};
    lower.fill(std::numeric_limits<double>::infinity());
    lower[6] = declared;
    std::array<bool, 7> worked_out{};
    worked_out[6] = true;
    for (std::size_t d = 0; d < 6; ++d) {
      if (next_[cell][d] == kOutside) continue;
      splits[d] = Attempt(cell, weights, d);
      if (splits[d].all_blocked) continue;  // neither moves the tool nor tells anything
      lower[d] = Sum(splits[d], [&](std::size_t c, const Weights& w) { return FromGroups(c, w); });
    }
    std::size_t chosen = 6;
    while (true) {
      chosen = static_cast<std::size_t>(std::ranges::min_element(lower) - lower.begin());
      if (worked_out[chosen]) break;
      worked_out[chosen] = true;
      lower[chosen] = Sum(splits[chosen], [&](std::size_t c, const Weights& w) { return Lower(c, w); });
    }
    double best = Upper(cell, weights).first - kLeastChange * wrong_;
    std::size_t cheapest = 6;
    for (std::size_t d = 0; d < 6; ++d) {
      if (lower[d] >= best) continue;
      const double upper = Sum(splits[d], [&](std::size_t c, const Weights& w) { return Upper(c, w).first; });
      if (upper < best) best = upper, cheapest = d;
    }
    if (lower[chosen] > Lower(cell, weights) + kLeastChange * wrong_) AddPoint(cell, weights, lower[chosen]);
    if (cheapest < 6) AddPlan(cell, weights, cheapest);
    return chosen < 6 ? static_cast<int>(chosen) : -1;
  }

  void AddPoint(std::size_t cell, const Weights& weights, double lower) {
    Point point{{}, lower};
    for (std::size_t h = 0; h < n_; ++h) {
      if (weights[h] > 0.0) point.weights.emplace_back(h, weights[h]);
    }
    std::ranges::sort(point.weights, {}, &std::pair<std::size_t, double>::second);
    std::vector<Point>& points = at_[cell].points;
    std::erase_if(points, [&](const Point& other) {
      Weights its(n_, 0.0);
      for (const auto& [h, weight] : other.weights) its[h] = weight;
      const double share = ShareIn(point, its, kWorthTheRest * other.lower);
      for (const auto& [h, weight] : point.weights) its[h] = std::max(0.0, its[h] - share * weight);
      return share * lower + FromGroups(cell, its) >= other.lower;
    });
    points.push_back(std::move(point));
  }

  /// The plan that attempts a step, and goes on with what is best for each part of the belief; where nothing is told
  /// the attempt is made up to `repeats` times, and what is best now follows.
  void AddPlan(std::size_t cell, const Weights& weights, std::size_t d) {
    const Split split = Attempt(cell, weights, d);
    const auto next = split.cell[0];
    std::array<int, 3> then{};
    for (std::size_t o = 0; o < 3; ++o) then[o] = Upper(split.cell[o], split.parts[o]).second;
    const double again = noise_.false_stop + noise_.slip;
    int repeats = 1;
    for (double left = again; split.all_free && left > 1e-13; left *= again) ++repeats;
    const double left = std::pow(again, repeats);
    Weights plan(n_, 0.0);
    for (std::size_t h = 0; h < n_; ++h) {
      if (BlockedAt(cell, h)) continue;  // the tool is not here then
      const bool blocked = BlockedAt(next, h);
      const double contact = CostOf(cell, then[1], h);
      const double stays = CostOf(cell, then[2], h);
      if (split.all_free) {
        plan[h] = blocked ? repeats * BlockedCost() + stays
                          : (1.0 - left) * (FreeCost() / Advances() + CostOf(next, then[0], h)) + left * stays;
      } else if (blocked) {
        plan[h] = BlockedCost() + (1.0 - noise_.missed_contact) * contact + noise_.missed_contact * stays;
      } else {
        plan[h] =
            FreeCost() + Advances() * CostOf(next, then[0], h) + noise_.false_stop * contact + noise_.slip * stays;
      }
    }
    std::vector<Weights>& plans = at_[cell].plans;
    std::erase_if(plans, [&](const Weights& other) { return std::ranges::equal(plan, other, std::less_equal<>()); });
    plans.push_back(std::move(plan));
  }

  void Trial(std::size_t start, double width) {
    std::vector<std::pair<std::size_t, Weights>> trial;
    std::size_t cell = start;
    Weights weights = start_;
    while (trial.size() < kLongestTrial) {
      const int d = Backup(cell, weights);
      trial.emplace_back(cell, weights);
      if (d < 0) break;
      Split split = Attempt(cell, weights, static_cast<std::size_t>(d));
      if (split.all_free) {
        split.parts[0] = weights;
        split.parts[1].assign(n_, 0.0), split.parts[2].assign(n_, 0.0);
      }
      double most = 0.0;
      std::size_t widest = 3;
      for (std::size_t o = 0; o < 3; ++o) {
        const double mass = std::accumulate(split.parts[o].begin(), split.parts[o].end(), 0.0);
        const double gap = Upper(split.cell[o], split.parts[o]).first - Lower(split.cell[o], split.parts[o]);
        if (gap - width * mass > most) most = gap - width * mass, widest = o;
      }
      if (widest == 3) break;
      cell = split.cell[widest];
      weights = std::move(split.parts[widest]);
      const double mass = std::accumulate(weights.begin(), weights.end(), 0.0);
      for (double& w : weights) w = w < kTiny * mass ? 0.0 : w;
      const double kept = std::accumulate(weights.begin(), weights.end(), 0.0);
      for (double& w : weights) w /= kept;
    }
    for (; !trial.empty(); trial.pop_back()) Backup(trial.back().first, trial.back().second);
  }

  const LatticeProblemData& data_;
  Noise noise_;
  double wrong_;
  std::size_t n_;
  std::vector<Cell> cells_;
  std::vector<std::uint8_t> blocked_;  ///< cell * hypotheses + hypothesis
  std::vector<std::array<int, 6>> next_;
  std::vector<Group> groups_;
  std::vector<Bounds> at_;
  Weights start_;
  std::size_t backups_ = 0;
  mutable Weights rest_;  ///< scratch
  mutable std::vector<std::pair<double, std::size_t>> order_;
};

}  // namespace feeler::planner::testing
