#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/execution/contact/contact_evidence.h"
#include "feeler/execution/contact/executor_options.h"
#include "feeler/planner/contact/contact_map.h"
#include "feeler/planner/noise/noisy_outcomes.h"
#include "feeler/policies/policy.h"

namespace feeler::execution {

/// A hypothesis that is still possible, and how far from its lattice point the contacts felt so far put the target if
/// it is the true one (cells; within half a cell for a truth that rounds to it).
struct TrackedHypothesis {
  policies::Hypothesis hypothesis;
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();
  Eigen::Vector3d position() const { return hypothesis.offset.cast<double>() + anchor; }
};

/// Cells that the tool at `tool` (lattice coordinates) would travel to contact under the hypothesis.
double PredictTravel(const planner::ContactMap& map, const TrackedHypothesis& tracked, const Eigen::Vector3d& tool,
                     Direction direction);

/// One of the outcomes that a guarded move can have under the hypotheses left, and how well it explains the reading.
struct OutcomeMatch {
  Outcome outcome;
  double mismatch = 0.0;  ///< cells, of the hypothesis that explains the reading best
  double weight = 0.0;    ///< of the hypotheses with this outcome that explain it within the tolerance
  std::size_t best = 0;   ///< index of that hypothesis
};

/// How far, in cells, the reading lies from what the hypothesis predicts: for a contact the distance of the contact
/// from the predicted wall, whether or not the move was meant to reach it; for a free reading the part of the motion
/// that should have been blocked.
double Mismatch(const planner::ContactMap& map, const TrackedHypothesis& tracked, const Touch& touch);

/// Groups the hypotheses by their outcome of `move` from lattice cell `robot` and orders the outcomes that explain the
/// reading within the tolerance, best first (ties: larger weight). Empty: the reading is off the tree.
std::vector<OutcomeMatch> MatchOutcomes(const planner::ContactMap& map, const std::vector<TrackedHypothesis>& tracked,
                                        const Cell& robot, const GuardedMove& move, const Touch& touch,
                                        const MatchOptions& options = {});

/// Keeps the hypotheses with this outcome that explain the reading within the tolerance, and shifts the anchor of each
/// along the axis of the touch so that it explains it exactly.
void Settle(const planner::ContactMap& map, const Cell& robot, const GuardedMove& move, const Touch& touch,
            const Outcome& outcome, const MatchOptions& options, std::vector<TrackedHypothesis>& tracked);

/// The same for readings that are wrong now and then: every hypothesis is weighed by the probability with which it
/// makes the outcome of the move (planner/noise), those explained by the reading are shifted as above, and those below
/// a share of 1e-9 are dropped. Weights sum to 1 afterwards. False, and nothing is changed, if no hypothesis allows the
/// outcome.
bool Weigh(const planner::ContactMap& map, const Cell& robot, const GuardedMove& move, const Touch& touch,
           const Outcome& outcome, const MatchOptions& options, planner::NoisyMoves& noise,
           std::vector<TrackedHypothesis>& tracked);

/// The outcome of a reading taken at its word, whatever the hypotheses say: cells travelled from the lattice point of
/// the robot cell, and contact unless it came behind the end of the move.
Outcome OutcomeAsRead(const GuardedMove& move, double travelled_cells, bool contact);

/// Index of the likeliest hypothesis (of equally likely ones the first).
std::size_t Likeliest(const std::vector<TrackedHypothesis>& tracked);

/// Keeps the likeliest hypotheses that together have probability `confidence`, in their order.
void KeepLikely(double confidence, std::vector<TrackedHypothesis>& tracked);

/// A small shift of the target across the touch that explains a reading which is off the tree: an edge met (or missed)
/// because the truth lies at the rim of its cell, or else a wall close beside that the tool scraped along. In cells;
/// empty if there is none.
std::optional<Eigen::Vector3d> GrazeShift(const planner::ContactMap& map, const std::vector<TrackedHypothesis>& tracked,
                                          const Touch& touch, const MatchOptions& options = {});

}  // namespace feeler::execution
