#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/lattice.h"
#include "feeler/execution/contact/contact_evidence.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::execution {

/// A touch that tells where the target is along an axis: free way points of the tool relative to the target (lattice
/// displacements, the first is where it is now) and the probe from the last one.
struct ConfirmingTouch {
  std::vector<Cell> path;
  Direction direction = Direction::kPlusX;
  double travel_cells = 0.0;  ///< predicted, from the last way point
};

/// The broad wall across `axis` that is felt soonest: one that is met at the same place from the eight neighbouring
/// lines as well, so that an error across the axis does not matter. `displacement`: of the tool from the target, cells.
/// Empty if the target has no such wall in reach.
std::optional<ConfirmingTouch> PlanConfirmingTouch(const planner::ContactMap& map, const Eigen::Vector3d& displacement,
                                                   int axis, int orientation);

/// Moves the tool along way points relative to a target at `target` (lattice coordinates). False if a contact came; it
/// is added to the evidence when it came along an axis, and the tool has come off it.
bool FollowPath(const planner::ContactMap& map, const Eigen::Vector3d& target, const std::vector<Cell>& path,
                const std::string& kind, Mover& mover, std::vector<Touch>& evidence, FreeBy free_by = FreeBy::kBelief);

/// A box in lattice coordinates.
struct Region {
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();
};

/// Touches along the axes across `insertion` that no face has pinned, until none is left (or attempts run out); adds to
/// the evidence. Returns the last fit: of a target in `likely` (around the hypotheses left), or, if that leaves touches
/// unexplained, the better one in `possible` (around the start belief).
TargetFit Confirm(const planner::ContactMap& map, Direction insertion, int orientation, const Region& likely,
                  const Region& possible, Mover& mover, std::vector<Touch>& evidence);

}  // namespace feeler::execution
