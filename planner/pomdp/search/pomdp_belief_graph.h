#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <unordered_map>
#include <vector>

#include "feeler/planner/pomdp/model/belief_update.h"
#include "feeler/planner/pomdp/model/pomdp.h"
#include "feeler/planner/pomdp/model/pulse.h"
#include "feeler/planner/pomdp/model/state_bounds.h"

namespace feeler::planner {

/// The belief MDP of a POMDP as a model of the searches (BeliefModel), grown on demand: costs to a goal.
///
/// A discounted POMDP becomes a goal POMDP (Bonet and Geffner 2009, Section 5; Theorem 5 there): with C the greatest
/// reward, an action costs C - R(b, a), and with probability 1 - discount it ends at the goal. All values then obey
/// V*(b) = C / (1 - discount) - V*_goal(b) (adding a constant to all rewards shifts values by it over 1 - discount).
/// The goal is left out of the successors, so that shares sum to the discount. With a discount of 1 costs are negated
/// rewards and the absorbing states are the goals. Beliefs within absorbing states have a known value, and count as
/// goals; what they cost is part of the action that leads to them.
///
/// Beliefs are normalised, weights are 1. `levels` = 0: two beliefs are one if they agree up to rounding (1e-12), and
/// what a search proves here holds for the POMDP. `levels` = D > 0: RTDP-Bel's discretisation, d(b)(s) = ceil(D b(s));
/// the first belief met stands for all that share its d(b), until Restart() is called: from then on Actions are those
/// of the belief entered last (SharesValues), and not kept. Nothing is proven.
///
/// Without discount goals drop out of beliefs, which are then normalised over what is left: whatever is done, a goal
/// costs nothing, so V*(b) = P(no goal yet) V*(b given that) whether a goal shows or not. Shares carry that
/// probability.
///
/// Without discount an action may cost nothing and leave a belief as it is for a while, and lower bounds do not rise
/// along a way that costs nothing and comes back. So, with exact beliefs, states of the same future are one (the
/// reading that led to a state is no part of what follows), and an action that leaves the belief as it is with
/// probability q < 1 is repeated until it does not: cost and shares over 1 - q, which changes no optimal value.
/// Successors() then leaves the belief itself out.
class PomdpBeliefGraph {
 public:
  struct Action {
    double cost = 0.0;
    std::uint32_t action = 0;  ///< of the POMDP
    std::uint32_t first = 0, count = 0;
  };
  struct Successor {
    std::uint32_t belief = 0;
    std::uint32_t observation = 0;
    double share = 0.0;  ///< probability times discount
  };

  PomdpBeliefGraph(const Pomdp& pomdp, const StateBounds& bounds, int levels);

  /// Where `stop` (asked now and then) says so, Actions throws Interrupted: one belief may take long. The belief is
  /// then left unexpanded.
  void SetStop(std::function<bool()> stop) { pulse_ = Pulse(std::move(stop)); }

  /// The start belief; a goal if Trivial().
  std::uint32_t Start() const { return 0; }
  /// True if the initial belief lies within absorbing states.
  bool Trivial() const { return IsGoal(pomdp_.start); }
  /// What of the initial belief Start() stands for: its value is this times that of Start().
  double start_share() const { return start_share_; }
  std::size_t size() const { return beliefs_.size(); }
  double Weight(std::uint32_t /*b*/) const { return 1.0; }
  double Heuristic(std::uint32_t b) const { return beliefs_[b].heuristic; }
  bool expanded(std::uint32_t b) const { return beliefs_[b].first_action != kUnexpanded; }
  /// Enters the initial belief itself. From here on no actions are kept. Returns its number, Start().
  std::uint32_t Restart();
  /// Enters the belief itself behind successor k of an action of the belief entered last. Returns its number.
  std::uint32_t Enter(const Action& action, std::uint32_t k);
  /// After Restart(): only of the belief entered last.
  std::span<const Action> Actions(std::uint32_t b) {
    if (!expanded(b)) Expand(b);
    return {actions_.data() + beliefs_[b].first_action, beliefs_[b].action_count};
  }
  template <class F>
  void ForEachShare(const Action& action, F f) const {
    for (std::uint32_t i = action.first; i < action.first + action.count; ++i)
      f(successors_[i].belief, successors_[i].share);
  }
  /// Every outcome of an action that is no goal, with its observation.
  std::span<const Successor> Successors(const Action& action) const {
    return {successors_.data() + action.first, action.count};
  }

  const Pomdp& pomdp() const { return pomdp_; }
  std::span<const SparseEntry> Belief(std::uint32_t b) const { return beliefs_[b].states; }
  bool IsGoal(std::span<const SparseEntry> belief) const;
  /// Without discount: takes goals out of a belief that is none; returns the probability of what is left.
  double DropGoals(std::vector<SparseEntry>& belief) const;
  /// Lower bound of the cost of a belief: from the fast informed bound.
  double HeuristicOf(std::span<const SparseEntry> belief) const { return to_goal_ - BestRow(bounds_.informed, belief); }
  /// The number of a belief; kNone if it has not been met.
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::uint32_t Find(std::span<const SparseEntry> belief) const;
  std::uint32_t Intern(std::vector<SparseEntry> belief);
  /// Cost to reward and back: value + cost = this.
  double to_goal() const { return to_goal_; }
  /// C - R(b, a) for any belief.
  double CostOf(std::span<const SparseEntry> belief, std::size_t action) const;
  std::size_t bytes() const { return bytes_; }

 private:
  static constexpr std::uint32_t kUnexpanded = ~std::uint32_t{0};
  struct Node {
    std::vector<SparseEntry> states;
    double heuristic = 0.0;
    std::uint32_t first_action = kUnexpanded;
    std::uint32_t action_count = 0;
  };
  /// With a discount of 1 and exact beliefs: for each state the first of the same rewards and transitions.
  void FindTwins();
  /// The belief over those first states.
  std::vector<SparseEntry> Merged(std::span<const SparseEntry> belief) const;
  std::uint32_t FindMerged(std::span<const SparseEntry> belief) const;
  /// Takes the belief itself out of the successors of its last action, which reaches goals with probability `to_goal`.
  void RepeatUntilChanged(std::uint32_t b, double to_goal, Action& action);
  /// True if an outcome is the belief before, not only up to the rounding of keys.
  static bool Unchanged(std::span<const SparseEntry> before, std::span<const SparseEntry> after);
  std::int64_t Level(double probability) const;
  std::uint64_t HashOf(std::span<const SparseEntry> belief) const;
  bool Same(std::span<const SparseEntry> a, std::span<const SparseEntry> b) const;
  void Expand(std::uint32_t b);
  /// Makes it the belief whose actions are known, to be worked out when they are asked for.
  void SetEntered(std::uint32_t number, std::vector<SparseEntry> belief);

  const Pomdp& pomdp_;
  const StateBounds& bounds_;
  int levels_;
  Pulse pulse_;
  std::vector<std::uint8_t> absorbing_;
  std::vector<std::uint32_t> twin_;  ///< empty: each its own
  double constant_ = 0.0;            ///< C
  double to_goal_ = 0.0;             ///< C / (1 - discount); 0 with a discount of 1
  double start_share_ = 1.0;
  std::vector<Node> beliefs_;
  std::vector<Action> actions_;
  std::vector<Successor> successors_;
  std::unordered_multimap<std::uint64_t, std::uint32_t> index_;
  std::vector<SparseEntry> entered_;  ///< empty before Restart()
  std::uint32_t entered_number_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace feeler::planner
