#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <unordered_map>
#include <vector>

#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/openings/openings.h"
#include "feeler/planner/search/greedy_completion.h"

namespace feeler::planner {

/// An incumbent for maps with dead ends (openings), made from policies for the map in which they are filled. From each
/// belief it does the best of
/// - what the greedy policy of the filled map does, with a look into each opening that is passed on the way (where a
///   look is worth its cost). The plan is made anew whenever hypotheses have gone; what the filled map does not foresee
///   (the tool in an opening) is completed greedily on the map itself;
/// - where all hypotheses are of one layer: a tour through their openings, one after the other, up to the place where
///   the filled map's policy for the rest is cheaper.
///
/// The value of a belief is at least the cost of the recorded action plus the values of its outcomes, so following
/// recorded actions costs at most the value, and never cycles. Same interface as GreedyCompletion.
class OpenPolicy {
 public:
  /// `filled` is the graph of the same problem on the filled map, with heuristic; both canonical or neither.
  OpenPolicy(BeliefGraph& graph, BeliefGraph& filled, const Openings& openings,
             GreedyCompletion<BeliefGraph>& completion);

  using StopCondition = std::function<std::optional<SolverStatus>(std::int64_t expansions)>;
  /// Finds the policy from a belief, or says why `stop` ended the search for it.
  std::optional<SolverStatus> Run(BeliefId start, StopCondition stop);

  bool Solved(BeliefId b) const { return Known(b) || completion_.Solved(b); }
  double Value(BeliefId b) const {
    const double own = Known(b) ? nodes_[b].value : kInfinity;
    return completion_.Solved(b) ? std::min(own, completion_.Value(b)) : own;
  }
  int Action(BeliefId b) const {
    const bool own = Known(b) && (!completion_.Solved(b) || nodes_[b].value < completion_.Value(b));
    return own ? nodes_[b].action : completion_.Action(b);
  }
  /// On the map itself: those on the filled map are not counted.
  std::int64_t expansions() const { return expansions_ + completion_.expansions(); }
  std::int64_t trials() const { return 0; }
  /// With those of the filled map's graph and policies.
  std::size_t bytes() const {
    return nodes_.capacity() * sizeof(State) + found_.capacity() + filled_.bytes() + filled_policy_.bytes() +
           completion_.bytes();
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  struct State {
    double value = kInfinity;
    std::int32_t action = -1;
  };
  /// A belief of a tour and the move made there.
  struct Stop {
    BeliefId belief = kNoBelief;
    GuardedMove move;
  };
  enum class TourKind { kSpiral, kSweep };
  /// Thrown through the recursion when `stop_` ends it.
  struct Stopped {
    SolverStatus why;
  };

  bool Known(BeliefId b) const { return b < nodes_.size() && nodes_[b].action >= 0; }
  /// Cost to go, times the weight, of the best of the ways above; of the first alone unless `tours`.
  double Find(BeliefId b, bool tours);
  double Complete(BeliefId b);
  void CheckStop() const;
  /// The same belief on the filled map, less the hypotheses under which the tool is in an opening; none if the others
  /// are a goal.
  std::optional<BeliefId> Filled(BeliefId b);
  /// Estimate of the cost to go by the filled map alone.
  double FilledValue(BeliefId b);
  /// The openings of one layer's hypotheses, in an order of short steps.
  std::vector<std::pair<Cell, Direction>> Order(BeliefId b, TourKind kind) const;
  struct Walk;
  /// Where a tour is left: before `stop`, for the filled map's policy from `belief` (none: the tour is complete).
  struct Exit {
    std::size_t stop = 0;
    BeliefId belief = kNoBelief;
  };
  /// Records the better of: the tour to its end, the tour up to the cheapest exit.
  void Tour(BeliefId b, TourKind kind);
  Walk WalkThroughOpenings(BeliefId start, TourKind kind);
  /// Goes on from `walk.end` by what is most likely; false where that leads nowhere.
  bool Make(const GuardedMove& move, Walk& walk);
  std::optional<Exit> BestExit(const Walk& walk);
  /// The move to make instead of `move`, so that openings on the way are looked into.
  GuardedMove WithLooks(BeliefId b, const GuardedMove& move, double value) const;
  /// Records the move at the belief if its value, with those of its outcomes, is less than what is known.
  double Record(BeliefId b, const GuardedMove& move, const std::vector<BeliefOutcome>& outcomes);

  BeliefGraph& graph_;
  BeliefGraph& filled_;
  const Openings& openings_;
  GreedyCompletion<BeliefGraph>& completion_;
  GreedyCompletion<BeliefGraph> filled_policy_;
  std::vector<State> nodes_;
  std::vector<char> found_;  ///< per belief: 1 found, 2 found with tours
  std::int64_t expansions_ = 0;
  StopCondition stop_;
};

}  // namespace feeler::planner
