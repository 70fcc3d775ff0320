#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/planner/search/belief_model.h"
#include "feeler/planner/search/stop_watch.h"

namespace feeler::planner {

/// RTDP-Bel (Algorithm 1 of the paper) with a sound convergence test.
///
/// `initial(b)` gives the value of a belief when it is met first: epsilon * heur(b) for RTDP-Bel, heur^E(b) for
/// E-RTDP-Bel, both times the belief's weight. As long as it is at most epsilon V*, so are all values at all times (a
/// Bellman update of values below epsilon V* stays below it, epsilon >= 1).
///
/// Convergence: a belief is *solved* when every belief reachable from it by greedy actions satisfies V(b) = Q(b, a) (up
/// to rounding); its greedy action is frozen there and then, and its value never changes again. Along frozen actions
/// V(b) = C(b,a) + sum P V(b'), so the frozen policy is acyclic where beliefs only shrink, as in lattice problems (a
/// cycle would cost nothing), and costs V(b) <= epsilon V*(b), up to rounding; in general POMDPs it may return to a
/// belief. The labelling procedure is LRTDP's CheckSolved (Bonet and Geffner 2003).
///
/// Beside V the algorithm keeps L, started at heur and never inflated, backed up with the same actions: a lower bound
/// at any time.
template <BeliefModel Model, class Initial>
class RtdpBel {
 public:
  using Belief = std::uint32_t;

  RtdpBel(Model& model, Initial initial, std::uint64_t seed)
      : model_(model), initial_(std::move(initial)), random_(seed, 0, "rtdp-bel") {}

  /// Algorithm 1 from belief `start`, until it is solved or `stop(expansions)` says why not to go on.
  template <class Stop>
  std::optional<SolverStatus> Run(Belief start, Stop stop) {
    std::vector<Belief> trial;
    while (!Solved(start)) {  // line 1
      ++trials_;
      trial.clear();
      Belief b = start;             // line 2
      while (b != kGoalOrSolved) {  // line 4; nothing can change behind a solved belief
        if (const auto why = stop(expansions_)) return why;
        const Backup best = Update(b);  // lines 5-7
        trial.push_back(b);
        if (best.action < 0) break;           // a dead end, of infinite value
        b = SampleSuccessor(b, best.action);  // lines 3, 8-10
      }
      while (!trial.empty() && CheckSolved(trial.back(), stop)) trial.pop_back();
    }
    return std::nullopt;
  }

  bool Solved(Belief b) const { return b < nodes_.size() && nodes_[b].solved; }
  /// The frozen action of a solved belief: an index into Model::Actions, negative in a dead end (no actions).
  int Action(Belief b) const { return nodes_[b].action; }
  /// Value and lower bound times the weight of the belief.
  double Value(Belief b) { return Node(b).value; }
  double Lower(Belief b) { return Node(b).lower; }
  std::int64_t expansions() const { return expansions_; }
  std::int64_t trials() const { return trials_; }
  std::int64_t updates() const { return updates_; }
  /// Of its own, without the model's.
  std::size_t bytes() const { return nodes_.capacity() * sizeof(State); }

 private:
  static constexpr Belief kGoalOrSolved = ~Belief{0};
  struct State {
    double value = 0.0;
    double lower = 0.0;
    std::int32_t action = -1;
    bool known = false;
    bool solved = false;
    std::uint32_t visit = 0;
  };
  struct Backup {
    int action = -1;
    double value = std::numeric_limits<double>::infinity();
    double lower = std::numeric_limits<double>::infinity();
  };

  State& Node(Belief b) {
    if (b >= nodes_.size()) nodes_.resize(std::max<std::size_t>(model_.size(), b + std::size_t{1}));
    State& node = nodes_[b];
    if (!node.known) {
      node.known = true;
      node.lower = model_.Heuristic(b);
      node.value = initial_(b);
    }
    return node;
  }

  static double Tolerance(double value) { return 1e-9 * std::max(1.0, std::abs(value)); }

  /// Line 5 for all actions and line 6: the least value; of equals the last, so that long moves win over short ones.
  Backup Evaluate(Belief b) {
    if (!model_.expanded(b)) ++expansions_;
    ++updates_;
    Backup best;
    int index = 0;
    for (const auto& action : model_.Actions(b)) {
      double value = action.cost;
      double lower = action.cost;
      ForEachShareOf(model_, action, [&](Belief next, double share) {
        const State& node = Node(next);
        value += share * node.value;
        lower += share * node.lower;
      });
      if (best.action < 0 || value <= best.value * (1.0 + 1e-12)) {
        best.action = index;
        best.value = std::min(best.value, value);
      }
      best.lower = std::min(best.lower, lower);
      ++index;
    }
    return best;
  }

  Backup Update(Belief b) {
    const Backup best = Evaluate(b);
    State& node = Node(b);
    node.value = best.value;  // line 7
    node.lower = std::max(node.lower, best.lower);
    return best;
  }

  /// Lines 8-10. The outcome of a state sampled from b_start and followed down the trial has the probability P(z | b,
  /// a), weight of the successor over weight of the belief; sampling outcomes is the same process. Only outcomes that
  /// are neither goals nor solved are drawn, except that trials in models with shares, whose policies may go round for
  /// ever, end at the goal as often as it is met.
  Belief SampleSuccessor(Belief b, int action) {
    double open = 0.0;
    const auto& chosen = model_.Actions(b)[static_cast<std::size_t>(action)];
    ForEachShareOf(model_, chosen,
                   [&](Belief next, double share) { open += Solved(next) ? 0.0 : share * model_.Weight(next); });
    if (open == 0.0) return kGoalOrSolved;
    if constexpr (HasShares<Model>) {
      double left = model_.Weight(b);
      ForEachShareOf(model_, chosen, [&](Belief next, double share) { left -= share * model_.Weight(next); });
      if (random_.Uniform() * (open + std::max(0.0, left)) >= open) return kGoalOrSolved;
    }
    double at = random_.Uniform() * open;
    Belief sampled = kGoalOrSolved;
    ForEachShareOf(model_, chosen, [&](Belief next, double share) {
      if (Solved(next) || (at < 0.0 && sampled != kGoalOrSolved)) return;
      at -= share * model_.Weight(next);
      sampled = next;
    });
    return sampled;
  }

  /// Labels `from` and its greedy graph solved if all residuals vanish; else updates what it visited.
  template <class Stop>
  bool CheckSolved(Belief from, Stop& stop) {
    if (Solved(from)) return true;
    ++visit_;
    bool consistent = true;
    std::vector<Belief> open = {from};
    std::vector<std::pair<Belief, int>> closed;
    Node(from).visit = visit_;
    while (!open.empty()) {
      const Belief b = open.back();
      open.pop_back();
      if (stop(expansions_)) return false;
      const Backup best = Evaluate(b);
      State& node = Node(b);
      closed.emplace_back(b, best.action);
      if (best.value != node.value && !(std::abs(best.value - node.value) <= Tolerance(best.value))) {
        consistent = false;
        continue;
      }
      if (best.action < 0) continue;
      ForEachShareOf(model_, model_.Actions(b)[static_cast<std::size_t>(best.action)], [&](Belief next, double) {
        State& state = Node(next);
        if (state.solved || state.visit == visit_) return;
        state.visit = visit_;
        open.push_back(next);
      });
    }
    if (consistent) {
      for (const auto& [b, action] : closed) {
        nodes_[b].solved = true;
        nodes_[b].action = action;
      }
    } else {
      for (auto it = closed.rbegin(); it != closed.rend(); ++it) Update(it->first);
    }
    return consistent;
  }

  Model& model_;
  Initial initial_;
  RandomStream random_;
  std::vector<State> nodes_;
  std::uint32_t visit_ = 0;
  std::int64_t expansions_ = 0;
  std::int64_t trials_ = 0;
  std::int64_t updates_ = 0;
};

}  // namespace feeler::planner
