#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/execution/contact/contact_evidence.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/execution/lattice/outcome_matching.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/policies/policy.h"

namespace feeler::execution {

/// Walks a policy on a robot whose target stands anywhere between the lattice points: turns the policy's moves into
/// motions, what was felt into outcomes, and keeps the hypotheses that explain it.
///
/// The lattice of the policy is tied to the world by an anchor. A contact tells where between two lattice points a wall
/// stands; the lattice is shifted along that axis so that the wall stands where the hypothesis says (mid-cell), and
/// later decisions along the axis are no longer near a tie.
///
/// With a policy that doubts its readings (Policy::doubt) hypotheses are weighed, not dropped: a contact that none
/// explains is taken for a false one, and when the policy inserts the likeliest are left, those that together have the
/// probability that it asks for. A false contact that comes again at the same place is no longer believed to be one.
/// Where steps may get lost a probe that ends short is no contact: the policy is told how far it came.
class Localizer {
 public:
  /// All arguments outlive the localizer. The tool stands at the start cell of the problem.
  Localizer(const Task& task, const planner::Problem& problem, policies::Policy& policy, Mover& mover,
            ExecutionRecord& record);

  /// Until the policy has no further guarded move (its last decision is returned, but for GiveUp), one hypothesis is
  /// left, or the tool fell into the opening (both: Insert). Throws ExecutionFailure, also for whatever the policy
  /// throws once the episode has begun; what its Begin throws is passed on.
  policies::Decision Run();

  /// Set if the tool fell into the opening and felt where it is: the position of the target (lattice coordinates).
  const std::optional<Eigen::Vector3d>& found_inside() const { return found_inside_; }

  const std::vector<TrackedHypothesis>& hypotheses() const { return tracked_; }
  const std::vector<Touch>& evidence() const { return evidence_; }

 private:
  struct Prediction {
    double nearest = 0.0;      ///< least travel under a hypothesis, cells from the lattice point of the robot cell
    double farthest = 0.0;     ///< greatest
    bool sure_contact = true;  ///< every hypothesis has a contact in lattice terms
  };

  policies::Belief View() const;
  policies::Decision Ask();
  bool Tell(const Outcome& outcome);
  /// Where the tool is to stand in the present robot cell.
  Eigen::Vector3d Station() const { return robot_.cast<double>() + problem_.map->phase() + anchor_ + kept_offset_; }
  Prediction Predict(const GuardedMove& move) const;

  void Carry(const GuardedMove& move);
  /// Takes a move that is known to be free into the pending motion.
  void Postpone(const GuardedMove& move);
  /// Carries out the pending motion.
  void Flush();
  void Feel(const GuardedMove& move, const Prediction& prediction);
  /// What a motion of `cells` from the station may meet beside a face across its way.
  MayMeet WhatMayBeMet(Direction direction, double cells) const;
  /// A probe begins so far, in cells, before the nearest contact that it may meet.
  double FastMargin(Direction direction) const;
  /// Whether a fast motion of so many cells before a probe saves time.
  bool FastIsWorth(Direction direction, double cells) const;
  Touch ProbeAlong(const GuardedMove& move, const Prediction& prediction);
  /// Tells the policy the outcome that explains the touch best and takes it over. False: nothing explains it within
  /// the tolerance (cells).
  bool TakeOver(const GuardedMove& move, const Touch& touch, double tolerance_cells);
  /// Tells the policy the outcome, takes it over and writes it down; `best`: the hypothesis that explains it, if one
  /// does. False, and nothing has happened, if the policy has no plan for it or no hypothesis allows it.
  bool Accept(const GuardedMove& move, const Touch& touch, const Outcome& outcome, const MatchOptions& matching,
              std::optional<std::size_t> best);
  /// Where steps get lost: takes a probe that ended short without a contact at its word. False: it is none, or no
  /// hypothesis allows it.
  bool TakeShort(const GuardedMove& move, const Touch& touch);
  /// With doubt: takes a contact that nothing explains for a false one. False: it came again at the same place, or no
  /// hypothesis allows that.
  bool TakeForFalse(const GuardedMove& move, const Touch& touch);
  /// With doubt, at the end: the likeliest hypotheses are left, and the touches that the likeliest explains.
  void SettleDoubt();
  /// Writes the answer to a move of the policy into the record. `outcomes`: that could have been.
  void LogDecision(const GuardedMove& move, const Outcome& outcome, int outcomes);
  /// Different outcomes of a move under the hypotheses left.
  int CountOutcomes(const GuardedMove& move) const;
  /// The tool has come off the contact of a reading that nothing explains: is it inside the opening?
  bool FoundInside();
  /// Straight out of the opening that the tool may stand in after it went in and met nothing: who takes over goes
  /// aside.
  void ComeOut();
  /// Fast to a place that the belief knows a free way to. The opening is closed to the belief: the first way across
  /// after one along the insertion begins slowly where the tool may have slipped in, up to where its walls would be.
  MotionReport FastFree(const Eigen::Vector3d& target, const PredictedCells& predicted);
  /// Shifts the lattice if an edge near by explains the touch; throws ExecutionFailure if none does.
  void ShiftOffEdge(const Touch& touch);
  void RetreatFromContact(Direction direction);
  [[noreturn]] void FailOffTree(const Touch& touch) const;

  const Task& task_;
  const planner::Problem& problem_;
  policies::Policy& policy_;
  Mover& mover_;
  ExecutionRecord& record_;
  std::vector<TrackedHypothesis> tracked_;
  std::vector<Touch> evidence_;
  Cell robot_;
  Eigen::Vector3d anchor_ = Eigen::Vector3d::Zero();
  bool face_felt_ = false;       ///< there was a contact along the insertion
  bool faces_known_ = false;     ///< the last one was where the one before it had put it
  bool went_in_ = false;         ///< along the insertion, and not yet across it
  bool stopped_inward_ = false;  ///< the last motion along the insertion ended at a contact
  bool lifted_ = false;          ///< the tool stands kRim above Station(), off what may be a lead-in
  Eigen::Vector3d kept_offset_ = Eigen::Vector3d::Zero();  ///< where a retreat ended off the lattice point
  std::optional<Eigen::Vector3d> found_inside_;
  std::optional<Direction> pending_;  ///< the tool still has to go this way to Station()
  const policies::Doubt* doubt_;      ///< of the policy; null: none
  std::optional<planner::NoisyMoves> noise_;
  std::optional<Touch> false_contact_;  ///< the last one that was taken for such
};

}  // namespace feeler::execution
