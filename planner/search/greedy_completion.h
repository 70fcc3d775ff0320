#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <queue>
#include <tuple>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "feeler/planner/options/solver_result.h"
#include "feeler/planner/search/belief_model.h"

namespace feeler::planner {

/// A complete policy fast, without a promise: from each belief walk, by the cheapest moves that show nothing, to the
/// move that splits the belief best, judged by its cost plus the heuristic values of its outcomes; then the same from
/// each outcome. It always ends, because every such step leaves fewer hypotheses. Used as an incumbent where RTDP-Bel
/// takes long. Same interface as RtdpBel, so that BoundedSearch can start from either.
///
/// It may be run again with another judgement of what walks and splits cost (a lower bound makes early splits that
/// leave much to do look cheap), or take a policy that was found elsewhere for one of its runs: of each belief the best
/// policy of any run is kept.
template <BeliefModel Model>
class GreedyCompletion {
 public:
  using Belief = std::uint32_t;
  using ModelAction = std::remove_cvref_t<decltype(*std::declval<Model&>().Actions(0).begin())>;

  /// By what a run chooses its plans; what they really cost is summed all the same.
  struct Judgement {
    std::function<double(Belief)> guess;             ///< of the value of a belief, times its weight
    std::function<double(const ModelAction&)> cost;  ///< of an action, times the weight of the belief; none: as it is
  };

  /// `estimate` guesses the value of a belief times its weight; without it the heuristic does.
  explicit GreedyCompletion(Model& model, std::function<double(Belief)> estimate = {}) : model_(model) {
    judgement_.guess = estimate ? std::move(estimate) : [&model](Belief b) { return model.Heuristic(b); };
  }

  /// Finds a policy from `start`; kUnlocalizable if there is none by the heuristic. Nothing is kept of beliefs in work
  /// when `stop(expansions)` interrupts.
  template <class Stop>
  std::optional<SolverStatus> Run(Belief start, Stop stop) {
    return Run(start, stop, judgement_);
  }

  /// The same by another judgement.
  template <class Stop>
  std::optional<SolverStatus> Run(Belief start, Stop stop, const Judgement& judgement) {
    ++run_;
    plans_.clear();
    std::vector<Belief> open = {start};
    while (!open.empty()) {
      const Belief b = open.back();
      if (Settled(b)) {
        open.pop_back();
        continue;
      }
      if (!plans_.contains(b)) {
        if (const auto why = MakePlan(b, stop, judgement)) return why;
      }
      const Plan& plan = plans_.at(b);
      if (!SuccessorsSettled(plan.path.back().first, plan.path.back().second, open)) continue;
      for (auto step = plan.path.rbegin(); step != plan.path.rend(); ++step) Settle(step->first, step->second);
      plans_.erase(b);
      open.pop_back();
    }
    return std::nullopt;
  }

  /// Takes a given policy from `start`, acyclic, as one of the runs: `action_of(b)` at each belief that it reaches.
  template <class ActionOf>
  void Take(Belief start, ActionOf action_of) {
    ++run_;
    std::vector<Belief> open = {start};
    while (!open.empty()) {
      const Belief b = open.back();
      if (!model_.expanded(b)) ++expansions_;
      const int action = action_of(b);
      if (!Settled(b) && !SuccessorsSettled(b, action, open)) continue;
      Settle(b, action);
      open.pop_back();
    }
  }

  bool Solved(Belief b) const { return b < nodes_.size() && nodes_[b].action >= 0; }
  double Value(Belief b) const { return nodes_[b].value; }
  int Action(Belief b) const { return nodes_[b].action; }
  std::int64_t expansions() const { return expansions_; }
  std::int64_t trials() const { return 0; }
  /// Of its own, without the model's; plans in work left out.
  std::size_t bytes() const { return nodes_.capacity() * sizeof(State); }

 private:
  struct State {
    double value = 0.0;
    std::int32_t action = -1;
    std::int32_t run = 0;  ///< the last in which it was settled
  };
  /// Moves that show nothing and at last one that splits (or leads to a belief that is solved): belief and action.
  struct Plan {
    std::vector<std::pair<Belief, int>> path;
  };
  struct Reached {
    double cost = 0.0;
    Belief from = 0;
    int action = -1;
  };

  void Settle(Belief b, int action) {
    if (b >= nodes_.size()) nodes_.resize(std::max<std::size_t>(model_.size(), b + std::size_t{1}));
    if (Settled(b)) return;  // another plan came by since; its policy stands
    const auto& chosen = model_.Actions(b)[static_cast<std::size_t>(action)];
    double value = chosen.cost;
    model_.ForEachSuccessor(chosen, [&](Belief next) { value += nodes_[next].value; });
    State& node = nodes_[b];
    node.run = run_;
    if (node.action >= 0 && node.value <= value) return;
    node.value = value;
    node.action = action;
  }

  /// Puts those that are not on the list.
  bool SuccessorsSettled(Belief b, int action, std::vector<Belief>& open) {
    bool settled = true;
    model_.ForEachSuccessor(model_.Actions(b)[static_cast<std::size_t>(action)], [&](Belief next) {
      if (Settled(next)) return;
      settled = false;
      open.push_back(next);
    });
    return settled;
  }

  bool Settled(Belief b) const { return b < nodes_.size() && nodes_[b].run == run_; }

  template <class Stop>
  std::optional<SolverStatus> MakePlan(Belief start, Stop& stop, const Judgement& judgement) {
    // A* over the beliefs with the same hypotheses; ends when no further walk can lead to a better split.
    using Entry = std::tuple<double, Belief>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    std::unordered_map<Belief, Reached> reached = {{start, {}}};
    queue.emplace(judgement.guess(start), start);
    double best = std::numeric_limits<double>::infinity();
    std::pair<Belief, int> last = {start, -1};
    while (!queue.empty()) {
      const auto [estimate, b] = queue.top();
      queue.pop();
      if (estimate >= best) break;
      const double cost = reached.at(b).cost;
      if (estimate > cost + judgement.guess(b) + 1e-9 * (1.0 + estimate)) continue;  // outdated
      if (const auto why = stop(expansions_)) return why;
      if (!model_.expanded(b)) ++expansions_;
      int index = -1;
      for (const auto& action : model_.Actions(b)) {
        ++index;
        const double walked = cost + (judgement.cost ? judgement.cost(action) : action.cost);
        double value = walked;
        Belief only = 0;
        int successors = 0;
        model_.ForEachSuccessor(action, [&](Belief next) {
          value += Settled(next) ? nodes_[next].value : judgement.guess(next);
          only = next;
          ++successors;
        });
        const bool splits = successors != 1 || model_.Weight(only) != model_.Weight(b);
        if (splits || Settled(only)) {
          if (value < best) {
            best = value;
            last = {b, index};
          }
          continue;
        }
        const auto [at, added] = reached.try_emplace(only, Reached{walked, b, index});
        if (!added) {
          if (walked >= at->second.cost) continue;
          at->second = {walked, b, index};
        }
        queue.emplace(value, only);
      }
    }
    if (last.second < 0) return SolverStatus::kUnlocalizable;  // no split within reach leads to finite values
    Plan plan;
    for (std::pair<Belief, int> step = last;; step = {reached.at(step.first).from, reached.at(step.first).action}) {
      plan.path.push_back(step);
      if (step.first == start) break;
    }
    std::ranges::reverse(plan.path);
    plans_.emplace(start, std::move(plan));
    return std::nullopt;
  }

  Model& model_;
  Judgement judgement_;  ///< of the first run
  std::vector<State> nodes_;
  std::unordered_map<Belief, Plan> plans_;
  std::int64_t expansions_ = 0;
  std::int32_t run_ = 0;
};

}  // namespace feeler::planner
