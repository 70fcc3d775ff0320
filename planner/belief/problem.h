#pragma once

#include <memory>
#include <string>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/core/task.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// One candidate pose of the target: a lattice offset from the estimated pose and an orientation layer of the contact
/// map.
struct Hypothesis {
  Cell offset = Cell::Zero();
  int orientation = 0;
  double weight = 1.0;  ///< prior, any positive scale; solvers normalise over the start belief
};

/// A start belief and everything needed to plan from it. Data only; `Validate` states the invariants.
struct Problem {
  std::string name;
  std::shared_ptr<const ContactMap> map;
  Cell start = Cell::Zero();           ///< robot cell r at the start
  std::vector<Hypothesis> hypotheses;  ///< distinct, in problem order; indices in results refer to it
  std::vector<int> move_lengths = {1, 2, 4, 8, 16};
  CostWeights cost;
  GoalKind goal = GoalKind::kSingleton;
  /// Goal `insertable`: the largest spread (greatest minus least offset, per axis, in cells) that one motion still
  /// inserts; all hypotheses left must share an orientation. Unused under goal `singleton`.
  Cell insertable_spread = Cell::Zero();
  /// Orientations are a lattice of two angles: orientation = yaw index * pitches + pitch index. Which ones are
  /// neighbours is of use to lower bounds only; any number is right.
  int pitches = 1;
  CellBox workspace;  ///< cells r may occupy; a guarded move is applicable if its far end lies inside

  /// Plan with this workspace as if it were unbounded and keep the result if every move of the policy stays inside it
  /// (else plan again with the bounds). Right for tasks, whose workspace is generous; false for lattice files.
  bool generous_workspace = false;
};

/// Throws InputError unless: there is a map and at least one hypothesis; hypotheses are distinct, with finite positive
/// weights and orientations the map has; move lengths start with 1, increase, at most 1024; costs are finite and >= 0
/// and a move is never free (per_cell + per_action > 0); the start lies in the workspace and is blocked under no
/// hypothesis.
void Validate(const Problem& problem);

/// True if all hypotheses have the same weight.
bool EquallyLikely(const Problem& problem);

/// True if the tool at cell `r` overlaps the target under `h`.
inline bool Blocked(const Problem& problem, const Cell& r, const Hypothesis& h) {
  return problem.map->Blocked(r - h.offset, h.orientation);
}

/// What a guarded move from cell `r` returns under `h`: cell by cell while the step to the next cell is free.
Outcome Simulate(const Problem& problem, const Cell& r, const GuardedMove& move, const Hypothesis& h);

/// True if a belief that holds exactly these hypotheses is a goal (one left, or all within one motion's reach).
bool IsGoal(const Problem& problem, const std::vector<Hypothesis>& hypotheses);

}  // namespace feeler::planner
