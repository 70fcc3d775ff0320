#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "feeler/core/task.h"
#include "feeler/execution/contact/contact_evidence.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::execution {

/// What the executor believes about an insertion, from the measured end pose and its estimate of the target.
struct BelievedInsertion {
  bool inserted = false;
  /// The tool stood on something where the opening should be, or a little in it.
  bool blocked = false;
  std::string reason;  ///< "inserted", or why not
};

/// Moves the tool through free space to a place in front of the opening of a target at `target` (lattice coordinates)
/// and inserts it compliantly. Throws ExecutionFailure when there is no free way. Contacts on the way are added to the
/// evidence and end the attempt.
BelievedInsertion ApproachAndInsert(const Task& task, const planner::ContactMap& map, const Eigen::Vector3d& target,
                                    int orientation, Mover& mover, std::vector<Touch>& evidence);

/// How far from the estimate, across the insertion, a tool at depth is still in the opening and not beside the target,
/// in cells: half of the way to the nearest place beside it where the contact map, whose opening is closed, lets the
/// tool stand as deep. Inside a target there is no other place for a tool than the opening. At least twice the
/// tolerance.
double FarthestInside(const Task& task, const planner::ContactMap& map, int orientation, double cell_m);

/// The part of it that begins in front of the opening, or in its mouth. A tool at depth that stands farther than
/// `farthest_inside` (cells, FarthestInside) from the estimate is beside the opening.
BelievedInsertion InsertFromHere(const Task& task, const Eigen::Vector3d& target, double farthest_inside, Mover& mover);

}  // namespace feeler::execution
