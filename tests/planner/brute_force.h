#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "feeler/planner/belief/lattice_problem.h"

namespace feeler::planner::testing {

/// The judge of the fast solvers: value iteration over all reachable beliefs of a lattice problem, from the definitions
/// of the lattice file alone (voxel sets, no contact map), with sets as sorted vectors. For small problems only.
class BruteForce {
 public:
  using Members = std::vector<int>;
  struct Belief {
    std::array<int, 3> robot;
    Members members;
    auto operator<=>(const Belief&) const = default;
  };
  struct Branch {
    Outcome outcome;
    int next = 0;
    double probability = 0.0;
  };
  struct Action {
    GuardedMove move;
    double cost = 0.0;
    std::vector<Branch> branches;
  };
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  explicit BruteForce(const LatticeProblemData& data) : data_(data) {
    for (const Cell& target : data.target) {
      for (const Cell& tool : data.tool) obstacle_.insert(Array(target - tool));
    }
    Members all;
    for (int i = 0; i < static_cast<int>(data.hypotheses.size()); ++i) all.push_back(i);
    Find({Array(data.start), all});
    for (std::size_t b = 0; b < beliefs_.size(); ++b) Expand(static_cast<int>(b));
    // From above: after k sweeps the least cost of a policy that ends within k moves; infinite where none does.
    values_.assign(beliefs_.size(), kInfinity);
    bool changed = true;
    while (changed) {
      changed = false;
      for (std::size_t b = beliefs_.size(); b-- > 0;) {
        double best = Goal(beliefs_[b].members) ? 0.0 : kInfinity;
        for (const Action& action : actions_[b]) best = std::min(best, Q(action, values_));
        changed = changed || best < values_[b] - 1e-13;
        values_[b] = std::min(values_[b], best);
      }
    }
  }

  double optimal_cost() const { return values_.front(); }
  const std::vector<Belief>& beliefs() const { return beliefs_; }
  const std::vector<std::vector<Action>>& actions() const { return actions_; }
  const std::vector<double>& values() const { return values_; }

  static double Q(const Action& action, const std::vector<double>& values) {
    double q = action.cost;
    for (const Branch& branch : action.branches) {
      q += branch.probability * values[static_cast<std::size_t>(branch.next)];
    }
    return q;
  }

  bool Goal(const Members& members) const {
    if (members.size() == 1) return true;
    if (data_.goal == GoalKind::kSingleton) return false;
    for (const int i : members) {
      for (const int j : members) {
        const Cell apart = Offset(i) - Offset(j);
        if ((apart.array().abs() > data_.insertable_spread.array()).any()) return false;
      }
    }
    return true;
  }

  /// What a move returns under hypothesis `i`, by the definition.
  Outcome Move(Cell robot, const GuardedMove& move, int i) const {
    for (int k = 0; k < move.cells; ++k) {
      const Cell next = robot + UnitCell(move.direction);
      if (obstacle_.contains(Array(next - Offset(i)))) return {k, true};
      robot = next;
    }
    return {move.cells, false};
  }

  /// Pairs that no sequence of moves tells apart, by a search over pairs.
  std::vector<std::pair<int, int>> IndistinguishablePairs() const {
    std::vector<std::pair<int, int>> pairs;
    for (int i = 0; i < static_cast<int>(data_.hypotheses.size()); ++i) {
      for (int j = i + 1; j < static_cast<int>(data_.hypotheses.size()); ++j) {
        if (!Goal({i, j}) && !Distinguishable(i, j)) pairs.emplace_back(i, j);
      }
    }
    return pairs;
  }

 private:
  static std::array<int, 3> Array(const Cell& c) { return {c.x(), c.y(), c.z()}; }
  static Cell ToCell(const std::array<int, 3>& a) { return {a[0], a[1], a[2]}; }
  const Cell& Offset(int i) const { return data_.hypotheses[static_cast<std::size_t>(i)].offset; }
  bool Inside(const Cell& c) const { return (c.array() >= 0).all() && (c.array() < data_.size.array()).all(); }

  bool Distinguishable(int i, int j) const {
    std::set<std::array<int, 3>> seen = {Array(data_.start)};
    std::vector<Cell> open = {data_.start};
    while (!open.empty()) {
      const Cell robot = open.back();
      open.pop_back();
      for (const Direction d : kDirections) {
        for (const int cells : data_.move_lengths) {
          if (!Inside(robot + cells * UnitCell(d))) continue;
          const Outcome a = Move(robot, {d, cells}, i);
          if (!(a == Move(robot, {d, cells}, j))) return true;
          const Cell next = robot + a.cells * UnitCell(d);
          if (seen.insert(Array(next)).second) open.push_back(next);
        }
      }
    }
    return false;
  }

  int Find(const Belief& belief) {
    const auto [at, added] = index_.try_emplace(belief, static_cast<int>(beliefs_.size()));
    if (added) {
      beliefs_.push_back(belief);
      actions_.emplace_back();
    }
    return at->second;
  }

  double Weight(const Members& members) const {
    double weight = 0.0;
    for (const int i : members) weight += data_.hypotheses[static_cast<std::size_t>(i)].weight;
    return weight;
  }

  void Expand(int b) {
    const Belief belief = beliefs_[static_cast<std::size_t>(b)];
    if (Goal(belief.members)) return;
    const Cell robot = ToCell(belief.robot);
    for (const Direction d : kDirections) {
      for (const int cells : data_.move_lengths) {
        if (!Inside(robot + cells * UnitCell(d))) continue;
        std::map<std::pair<int, bool>, Members> groups;
        for (const int i : belief.members) {
          const Outcome outcome = Move(robot, {d, cells}, i);
          groups[{outcome.cells, outcome.contact}].push_back(i);
        }
        if (groups.size() == 1 && groups.begin()->first.first == 0) continue;
        Action action{{d, cells}, 0.0, {}};
        for (const auto& [key, members] : groups) {
          const Outcome outcome{key.first, key.second};
          const double probability = Weight(members) / Weight(belief.members);
          action.cost += probability * data_.cost.Of(outcome, d);
          action.branches.push_back({outcome, Find({Array(robot + key.first * UnitCell(d)), members}), probability});
        }
        actions_[static_cast<std::size_t>(b)].push_back(action);
      }
    }
  }

  const LatticeProblemData data_;
  std::set<std::array<int, 3>> obstacle_;
  std::map<Belief, int> index_;
  std::vector<Belief> beliefs_;
  std::vector<std::vector<Action>> actions_;
  std::vector<double> values_;
};

}  // namespace feeler::planner::testing
