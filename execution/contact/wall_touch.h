#pragma once

#include <Eigen/Core>
#include <optional>

#include "feeler/core/direction.h"
#include "feeler/core/task.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::execution {

/// A side of the target that is square to a direction and broad enough to be touched at several places: probes along
/// `direction` meet it. Displacements of the tool from the target, in cells (lattice points).
struct BroadWall {
  Direction direction = Direction::kPlusX;
  int along = 0;  ///< axis on which the places of a touch differ
  Cell middle;    ///< a free displacement in front of it, about two cells off, as near to the mouth as it is flat
  double half_range = 0;  ///< it is flat this far to both sides of `middle` along `along`, in cells
};

/// The wall that probes along `direction` meet beside the mouth; empty if there is none that is flat for two cells.
std::optional<BroadWall> FindBroadWall(const planner::ContactMap& map, Direction insertion, Direction direction,
                                       int orientation);

/// Goes around a target believed at `target` (lattice coordinates) to the wall and touches it `offset` cells aside of
/// its middle, from farther off than that where the wall may be nearer by more: by `slack` cells, as it may be farther.
/// Returns the coordinate of the tool at contact, along the axis of the touch; empty if none comes within that, or one
/// comes on the way. The tool is off the wall again.
std::optional<double> TouchWall(const planner::ContactMap& map, const Eigen::Vector3d& target, int orientation,
                                const BroadWall& wall, int offset, double slack, const char* kind, Mover& mover);

/// The sides of a target that Recenter touches along each axis.
enum class Sides {
  kNearest,  ///< the one that is nearest to the tool
  kBoth,     ///< opposite ones: what both stand farther out by, or a tool that is turned a little, cancels
};

/// Where the target is across the insertion, from touches of its sides, each within `slack` cells of where it is
/// expected, the nearest first; one that is not there is looked for once more, twice as far around. An axis that cannot
/// be touched from both sides is felt from one, or left. Empty if a touch contradicts the contact map.
std::optional<Eigen::Vector3d> Recenter(const Task& task, const planner::ContactMap& map, const Eigen::Vector3d& target,
                                        int orientation, Sides sides, double slack, Mover& mover);

}  // namespace feeler::execution
