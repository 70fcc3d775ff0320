#pragma once

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "feeler/planner/belief/lattice_problem.h"
#include "tests/planner/random_problems.h"

namespace feeler::planner::testing {

/// A random small problem whose target has `orientations` shapes, one per orientation: every offset of a random lattice
/// problem in every orientation. `pitches` of them in a row.
inline Problem OrientedProblem(std::uint64_t seed, std::uint64_t index, RandomProblemOptions options, int orientations,
                               int pitches) {
  RandomStream random(seed, index, "oriented problem");
  options.most_hypotheses = 3;
  for (int tries = 0;; ++tries) {
    LatticeProblemData data = RandomProblem(seed, index + 1000 * static_cast<std::uint64_t>(tries), options);
    Problem problem = MakeLatticeProblem(data);
    std::vector<ContactMap::Layer> layers = {problem.map->CopyOfLayer(0)};
    for (int o = 1; o < orientations; ++o) {
      // A cell of the target moves: shapes that differ a little, as turned ones do.
      data.target[random.Index(data.target.size())] += UnitCell(kDirections[random.Index(options.three_d ? 6 : 4)]);
      try {
        layers.push_back(MakeLatticeProblem(data).map->CopyOfLayer(0));
      } catch (const InputError&) {  // the start is blocked
        break;
      }
    }
    if (static_cast<int>(layers.size()) < orientations) continue;
    problem.map = std::make_shared<ContactMap>(problem.map->domain(), std::move(layers), Eigen::Vector3d::Zero(), 0.5);
    problem.pitches = pitches;
    std::vector<Hypothesis> all;
    for (const Hypothesis& h : problem.hypotheses) {
      for (int o = 0; o < orientations; ++o) {
        all.push_back({h.offset, o, options.weights ? random.Uniform(0.1, 3.0) : 1.0});
      }
    }
    problem.hypotheses = all;
    return problem;
  }
}

/// Value iteration over all reachable beliefs of any small problem, from `Simulate` and `IsGoal` alone.
class ValueIteration {
 public:
  using Members = std::vector<int>;
  struct Belief {
    std::array<int, 3> robot;
    Members members;
    auto operator<=>(const Belief&) const = default;
  };
  struct Action {
    double cost = 0.0;
    std::vector<std::pair<double, int>> branches;  ///< probability, belief
  };

  explicit ValueIteration(const Problem& problem) : problem_(problem) {
    Members all;
    for (int i = 0; i < static_cast<int>(problem.hypotheses.size()); ++i) all.push_back(i);
    Find({{problem.start.x(), problem.start.y(), problem.start.z()}, all});
    for (std::size_t b = 0; b < beliefs_.size() && beliefs_.size() < kMost; ++b) Expand(b);
    values_.assign(beliefs_.size(), std::numeric_limits<double>::infinity());
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t b = beliefs_.size(); b-- > 0;) {
        double best = Goal(b) ? 0.0 : std::numeric_limits<double>::infinity();
        for (const Action& action : actions_[b]) best = std::min(best, Q(action, values_));
        changed = changed || best < values_[b] - 1e-13;
        values_[b] = std::min(values_[b], best);
      }
    }
  }

  /// False: there are too many beliefs, and the values mean nothing.
  bool complete() const { return beliefs_.size() < kMost; }
  const std::vector<Belief>& beliefs() const { return beliefs_; }
  const std::vector<std::vector<Action>>& actions() const { return actions_; }
  const std::vector<double>& values() const { return values_; }
  std::vector<Hypothesis> Hypotheses(std::size_t b) const {
    std::vector<Hypothesis> hypotheses;
    for (const int i : beliefs_[b].members) hypotheses.push_back(problem_.hypotheses[static_cast<std::size_t>(i)]);
    return hypotheses;
  }
  bool Goal(std::size_t b) const { return IsGoal(problem_, Hypotheses(b)); }
  static double Q(const Action& action, const std::vector<double>& values) {
    double q = action.cost;
    for (const auto& [probability, next] : action.branches) q += probability * values[static_cast<std::size_t>(next)];
    return q;
  }

 private:
  static constexpr std::size_t kMost = 60000;

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
    for (const int i : members) weight += problem_.hypotheses[static_cast<std::size_t>(i)].weight;
    return weight;
  }
  void Expand(std::size_t b) {
    if (Goal(b)) return;
    const Belief belief = beliefs_[b];
    const Cell robot(belief.robot[0], belief.robot[1], belief.robot[2]);
    for (const Direction d : kDirections) {
      for (const int cells : problem_.move_lengths) {
        if (!problem_.workspace.Contains(robot + cells * UnitCell(d))) continue;
        std::map<std::pair<int, bool>, Members> groups;
        for (const int i : belief.members) {
          const Outcome outcome =
              Simulate(problem_, robot, {d, cells}, problem_.hypotheses[static_cast<std::size_t>(i)]);
          groups[{outcome.cells, outcome.contact}].push_back(i);
        }
        if (groups.size() == 1 && groups.begin()->first.first == 0) continue;
        Action action;
        for (const auto& [key, members] : groups) {
          const double probability = Weight(members) / Weight(belief.members);
          action.cost += probability * problem_.cost.Of({key.first, key.second}, d);
          const Cell at = robot + key.first * UnitCell(d);
          action.branches.emplace_back(probability, Find({{at.x(), at.y(), at.z()}, members}));
        }
        actions_[b].push_back(action);
      }
    }
  }

  const Problem& problem_;
  std::map<Belief, int> index_;
  std::vector<Belief> beliefs_;
  std::vector<std::vector<Action>> actions_;
  std::vector<double> values_;
};

}  // namespace feeler::planner::testing
