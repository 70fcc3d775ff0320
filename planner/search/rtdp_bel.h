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

/// A model whose numbers may stand for several beliefs (RTDP-Bel's discretisation). Restart() enters the start belief,
/// Enter(action, k) the one behind the k-th listed outcome of an action; from then on Actions are those of the belief
/// entered last.
template <class Model>
concept SharesValues = requires(Model& model, std::uint32_t k) {
  { model.Restart() } -> std::convertible_to<std::uint32_t>;
  { model.Enter(*model.Actions(k).begin(), k) } -> std::convertible_to<std::uint32_t>;
};

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
/// Models whose beliefs stand for several (SharesValues) have a second stage, RunExactly.
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
        if (best.action < 0) break;                  // a dead end, of infinite value
        b = SampleSuccessor(b, best.action).belief;  // lines 3, 8-10
      }
      while (!trial.empty() && CheckSolved(trial.back(), stop)) trial.pop_back();
    }
    return std::nullopt;
  }

  /// Algorithm 1 with values shared and beliefs that are not: the table is of d(b), trials and backups are of b itself
  /// (Bonet and Geffner 2009), so that evidence too weak to change d(b) adds up within a trial. Goes on from the values
  /// that are there, without labels. Values of beliefs that share one go on changing for ever, so it ends when the mean
  /// value of the start belief over 2 n trials is that over the n before, up to `tolerance` (n = `window`, then twice
  /// as many, and so on), which proves nothing, or with what `stop(expansions)` says.
  template <class Stop>
  requires SharesValues<Model> std::optional<SolverStatus> RunExactly(double tolerance, int window, Stop stop) {
    for (State& node : nodes_) node.solved = false;
    double before = std::numeric_limits<double>::infinity();
    for (std::int64_t trials = window;; trials *= 2) {
      double sum = 0.0;
      for (std::int64_t i = 0; i < trials; ++i) {
        if (const auto why = TrialExactly(stop)) return why;
        sum += Value(model_.Start());
      }
      const double mean = sum / static_cast<double>(trials);
      if (!(std::abs(mean - before) > tolerance)) return std::nullopt;  // dead ends have no mean
      before = mean;
    }
  }

  bool Solved(Belief b) const { return b < nodes_.size() && nodes_[b].solved; }
  /// The frozen action of a solved belief: an index into Model::Actions, negative in a dead end (no actions).
  int Action(Belief b) const { return nodes_[b].action; }
  /// Value and lower bound times the weight of the belief.
  double Value(Belief b) { return Node(b).value; }
  /// True if it was backed up: its value is not just what it was met with.
  bool Updated(Belief b) const { return b < nodes_.size() && nodes_[b].updated; }
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
    bool updated = false;
    std::uint32_t visit = 0;
  };
  struct Backup {
    int action = -1;
    double value = std::numeric_limits<double>::infinity();
    double lower = std::numeric_limits<double>::infinity();
  };

  template <class Stop>
  std::optional<SolverStatus> TrialExactly(Stop& stop) {
    ++trials_;
    for (Belief b = model_.Restart();;) {
      if (const auto why = stop(expansions_)) return why;
      const Backup best = Update(b);
      if (best.action < 0) return std::nullopt;
      const Sampled next = SampleSuccessor(b, best.action);
      if (next.belief == kGoalOrSolved) return std::nullopt;
      b = model_.Enter(model_.Actions(b)[static_cast<std::size_t>(best.action)], next.outcome);
    }
  }

  struct Sampled {
    Belief belief = kGoalOrSolved;
    std::uint32_t outcome = 0;  ///< of those that Actions lists
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
    node.updated = true;
    node.lower = std::max(node.lower, best.lower);
    return best;
  }

  /// Lines 8-10. The outcome of a state sampled from b_start and followed down the trial has the probability P(z | b,
  /// a), weight of the successor over weight of the belief; sampling outcomes is the same process. Only outcomes that
  /// are neither goals nor solved are drawn, except that trials in models with shares, whose policies may go round for
  /// ever, end at the goal as often as it is met.
  Sampled SampleSuccessor(Belief b, int action) {
    double open = 0.0;
    const auto& chosen = model_.Actions(b)[static_cast<std::size_t>(action)];
    ForEachShareOf(model_, chosen,
                   [&](Belief next, double share) { open += Solved(next) ? 0.0 : share * model_.Weight(next); });
    if (open == 0.0) return {};
    if constexpr (HasShares<Model>) {
      double left = model_.Weight(b);
      ForEachShareOf(model_, chosen, [&](Belief next, double share) { left -= share * model_.Weight(next); });
      if (random_.Uniform() * (open + std::max(0.0, left)) >= open) return {};
    }
    double at = random_.Uniform() * open;
    Sampled sampled;
    std::uint32_t outcome = 0;
    ForEachShareOf(model_, chosen, [&](Belief next, double share) {
      const std::uint32_t number = outcome++;
      if (Solved(next) || (at < 0.0 && sampled.belief != kGoalOrSolved)) return;
      at -= share * model_.Weight(next);
      sampled = {next, number};
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
