#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/lattice.h"
#include "planner/belief/problem.h"

namespace feeler::policies {

using planner::Hypothesis;

/// What is known when a decision is due: the cell of the tool in the lattice of the problem, and the hypotheses that
/// are still possible, in the order of the problem. Weights are those of the start belief, not renormalised.
struct Belief {
  Cell robot = Cell::Zero();
  std::vector<Hypothesis> hypotheses;
};

/// The target is localized: insert. With `confirm` the executor first touches along axes that no contact has pinned;
/// without, it inserts at the mean of the hypotheses left (open loop).
struct Insert {
  bool confirm = true;
};

/// The policy has no further move. The reason stands in the episode record.
struct GiveUp {
  std::string reason;
};

/// What to do next. Executors visit every alternative.
using Decision = std::variant<GuardedMove, Insert, GiveUp>;

/// Decides the next action from what has been felt so far. One object serves many episodes, one after the other:
/// `Begin` erases the past. Not thread-safe: one object per thread. The caller accounts the CPU time of the calls as
/// planning time.
///
/// Protocol: Begin, then Next and Observe in turn until Next returns something else than a guarded move. `Next` is
/// repeatable: without an Observe in between it returns the same decision.
class Policy {
 public:
  virtual ~Policy() = default;

  /// The name in records and on the command line.
  virtual std::string_view name() const = 0;

  /// Starts an episode. Throws InputError when the policy does not fit the problem. The problem outlives the episode.
  virtual void Begin(const planner::Problem& problem) = 0;

  /// What to do in this belief: its hypotheses are consistent with every outcome observed since Begin.
  virtual Decision Next(const Belief& belief) = 0;

  /// Tells the outcome, in lattice terms, that the executor settled on for the move last returned by Next. False when
  /// the policy holds no plan for that outcome; it is then as before the call and may be told another outcome.
  virtual bool Observe(const Outcome& outcome) = 0;
};

}  // namespace feeler::policies
