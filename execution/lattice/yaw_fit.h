#pragma once

#include <Eigen/Core>
#include <numbers>
#include <optional>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/execution/contact/contact_evidence.h"
#include "feeler/execution/contact/lattice_frame.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::execution {

/// More than a confirming touch tells; a target that is turned farther was not the one that was felt.
inline constexpr double kLargestTurn_rad = 8.0 * std::numbers::pi / 180.0;

/// How far the target is turned about the insertion axis (right-handed about the direction out of the opening), against
/// the frame of the evidence.
struct YawFit {
  double yaw_rad = 0.0;
  double baseline_cells = 0.0;                       ///< between the outermost places of the wall that tells
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of the target by that wall, against where it was believed
};

/// The yaw from contacts with the same square wall at different places: a wall that is turned is met deeper on one
/// side. Only places near the middle of the wall count, where corners of the tool, not of the target, are met. Empty
/// if no wall was touched at places at least `least_baseline_cells` apart.
std::optional<YawFit> YawFromEvidence(const planner::ContactMap& map, Direction insertion,
                                      const std::vector<Touch>& evidence, const Eigen::Vector3d& target,
                                      int orientation, double least_baseline_cells = 4.0);

/// Touches the widest wall around a target believed at `target` at two places far apart, and adds the touches to the
/// evidence. Empty if no wall is wide enough or a touch misses it.
std::optional<YawFit> MeasureYaw(const Task& task, const planner::ContactMap& map, const Eigen::Vector3d& target,
                                 int orientation, Mover& mover, std::vector<Touch>& evidence);

/// The frame turned by `yaw_rad` about the insertion axis through `target`, which is its origin.
LatticeFrame TurnedFrame(const LatticeFrame& frame, Direction insertion, const Eigen::Vector3d& target, double yaw_rad);

}  // namespace feeler::execution
