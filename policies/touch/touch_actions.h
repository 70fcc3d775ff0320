#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/planner/contact/active_region.h"
#include "feeler/planner/contact/outcome_model.h"
#include "feeler/policies/policy.h"

namespace feeler::policies {

/// Goes to a pose in the vicinity of the hypotheses, through space that is free under all of them, and feels from
/// there: guarded moves, the last of which may meet contact.
struct TouchAction {
  std::vector<GuardedMove> approach;  ///< straight legs along the axes, none of which can meet contact
  GuardedMove probe;
};

/// What an action is worth in a belief.
struct TouchValue {
  double information_gain = 0.0;  ///< expected loss of entropy of the belief, nats
  double pruned = 0.0;            ///< expected share of the weight of the hypotheses that is ruled out
  double cost = 0.0;              ///< expected, approach included
};

/// The actions of touch-based localization for one problem.
///
/// A pose is any cell of the box around all hypotheses left, grown by `vicinity_cells`. It is approached by the
/// shortest way that is free under every hypothesis left among: straight along the three axes in some order; off to
/// where nothing can be met on one side of the target, over, and back. Poses without such a way are no actions.
class TouchActions {
 public:
  /// The problem outlives the object. `region`: of its contact map. `longest_probe`: cells, at least 1.
  TouchActions(const planner::Problem& problem, std::shared_ptr<const planner::ActiveRegion> region, int vicinity_cells,
               int longest_probe);

  /// An action whose pose and direction are uniform among those that exist, after at most `tries` draws that hit none.
  std::optional<TouchAction> Sample(const Belief& belief, RandomStream& random, int tries = 2000) const;
  /// Every action, poses lexicographic, directions in the order of kDirections.
  std::vector<TouchAction> All(const Belief& belief) const;
  /// The way to a pose; empty if it can't be reached as said above.
  std::optional<std::vector<GuardedMove>> Approach(const Belief& belief, const Cell& pose) const;

  /// Shortens the probe to what tells as much: one cell beyond the farthest contact. False: no hypothesis predicts
  /// contact, the probe tells nothing; the action is then as it was.
  bool Evaluate(const Belief& belief, planner::OutcomeModel& outcomes, TouchAction& action, TouchValue& value) const;

 private:
  CellBox Vicinity(const Belief& belief) const;
  std::optional<TouchAction> ActionAt(const Belief& belief, const Cell& pose, Direction direction) const;
  bool Free(const Belief& belief, const Cell& from, const GuardedMove& move) const;
  bool FreeWay(const Belief& belief, const Cell& pose, const std::vector<GuardedMove>& way) const;

  const planner::Problem& problem_;
  std::shared_ptr<const planner::ActiveRegion> region_;
  int vicinity_cells_;
  int longest_probe_;
};

/// Where the tool is after an action whose probe travelled `cells`.
Cell EndOf(const Cell& robot, const TouchAction& action, int cells);

}  // namespace feeler::policies
