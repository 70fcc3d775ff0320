#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "feeler/planner/search/belief_model.h"
#include "feeler/planner/search/stop_watch.h"

namespace feeler::planner {

/// The certified solver: RTDP between two bounds (after McMahan, Likhachev and Gordon 2005, and HSVI of Smith and
/// Simmons 2004).
///
/// L(b) <= V*(b): starts at the heuristic and is raised by Bellman updates, which keep it below V*. U(b) >= V*(b): the
/// cost of a complete policy from b, infinite while none is known. It starts at the incumbent (a policy found before,
/// which may become better between two runs), and Bellman updates over actions whose successors all have a U lower it.
/// The action is recorded with each improvement. Following recorded actions never cycles: along them U falls by at
/// least the cost of the move.
///
/// A trial follows the action of least L, then the successor of the widest gap, and ends where U <= gap L: if that
/// holds for all successors of an action it holds for the belief, so nothing below needs work. The search is done when
/// it holds at the start. (Completing every belief that a trial meets, to give it a U at once, was ten to fifty times
/// slower.)
template <BeliefModel Model, class Incumbent>
class BoundedSearch {
 public:
  using Belief = std::uint32_t;

  BoundedSearch(Model& model, Incumbent& incumbent, double gap, double inflation = 1.0)
      : model_(model), incumbent_(incumbent), gap_(gap), inflation_(inflation) {}

  /// From `start` until the gap is closed or `stop(expansions)` says why not to
  /// go on.
  template <class Stop>
  std::optional<SolverStatus> Run(Belief start, Stop stop) {
    std::vector<Belief> trial;
    while (!Closed(start)) {
      ++trials_;
      trial.clear();
      Belief b = start;
      while (!Closed(b) && trial.size() < kLongestTrial) {
        if (const auto why = stop(expansions())) return why;
        const int action = Update(b);
        trial.push_back(b);
        const Belief next = WidestSuccessor(b, action);
        if (next == kNone) break;
        b = next;
      }
      for (; !trial.empty(); trial.pop_back()) Update(trial.back());
    }
    return std::nullopt;
  }

  /// Times the weight of the belief.
  double Lower(Belief b) { return Node(b).lower; }
  double Upper(Belief b) { return std::min(Node(b).upper, incumbent_.Solved(b) ? incumbent_.Value(b) : kInfinity); }
  /// The action of the best policy found: an index into Model::Actions.
  int Action(Belief b) { return Improved(b) ? Node(b).action : incumbent_.Action(b); }
  /// False where the best policy found is the incumbent's.
  bool Improved(Belief b) {
    return Node(b).action >= 0 && !(incumbent_.Solved(b) && incumbent_.Value(b) < Node(b).upper);
  }
  std::int64_t trials() const { return trials_; }
  /// Of its own, without the model's and the incumbent's.
  std::size_t bytes() const { return nodes_.capacity() * sizeof(State); }
  std::int64_t expansions() const { return expansions_ + incumbent_.expansions(); }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  static constexpr Belief kNone = ~Belief{0};
  static constexpr std::size_t kLongestTrial = 10000;
  static constexpr double kUnknownFirst = 1e100;
  struct State {
    double lower = -1.0;  ///< negative: not met yet
    double upper = kInfinity;
    double guess = 0.0;
    std::int32_t action = -1;
  };

  State& Node(Belief b) {
    if (b >= nodes_.size()) nodes_.resize(std::max<std::size_t>(model_.size(), b + std::size_t{1}));
    State& node = nodes_[b];
    if (node.lower < 0.0) {
      node.lower = model_.Heuristic(b);
      node.guess = inflation_ * node.lower;
    }
    return node;
  }
  bool Closed(Belief b) { return Upper(b) <= gap_ * Lower(b) * (1.0 + 1e-10) + 1e-10; }

  bool FollowsGuess() const { return inflation_ > 1.0 && trials_ % 2 != 0; }

  /// Bellman updates of the bounds and the guess; returns the action to follow.
  int Update(Belief b) {
    if (!model_.expanded(b)) ++expansions_;
    double least = kInfinity;
    double best = Upper(b);
    double least_guess = kInfinity;
    int least_action = -1;
    int best_action = -1;
    int guess_action = -1;
    int index = 0;
    for (const auto& action : model_.Actions(b)) {
      double lower = action.cost;
      double upper = action.cost;
      double guess = action.cost;
      ForEachShareOf(model_, action, [&](Belief next, double share) {
        lower += share * Lower(next);
        upper += share * Upper(next);
        guess += share * Node(next).guess;
      });
      if (guess_action < 0 || guess < least_guess) {
        least_guess = guess;
        guess_action = index;
      }
      if (least_action < 0 || lower <= least * (1.0 + 1e-12)) {
        least = std::min(least, lower);
        least_action = index;
      }
      if (upper < best * (1.0 - 1e-12)) {
        best = upper;
        best_action = index;
      }
      ++index;
    }
    State& node = Node(b);
    node.lower = std::max(node.lower, least);
    node.guess = std::max(node.lower, least_guess);
    if (best_action >= 0) {
      node.upper = best;
      node.action = best_action;
    }
    return FollowsGuess() ? guess_action : least_action;
  }

  Belief WidestSuccessor(Belief b, int action) {
    Belief widest = kNone;
    double width = 0.0;
    ForEachShareOf(model_, model_.Actions(b)[static_cast<std::size_t>(action)], [&](Belief next, double share) {
      if (Closed(next)) return;
      const double upper = Upper(next);
      // Where no policy is known yet, the belief's own lower bound stands for how much there is to learn. Where a
      // policy may return to a belief, such a belief comes first: else a trial may go round without ever meeting it.
      const double unknown = HasShares<Model> ? kUnknownFirst : 1.0;
      const double here = share * (upper < kInfinity ? upper - gap_ * Lower(next) : unknown * Lower(next));
      if (widest == kNone || here > width) {
        widest = next;
        width = here;
      }
    });
    return widest;
  }

  Model& model_;
  Incumbent& incumbent_;
  double gap_;
  double inflation_;
  std::vector<State> nodes_;
  std::int64_t expansions_ = 0;
  std::int64_t trials_ = 0;
};

}  // namespace feeler::planner
