#pragma once

#include <Eigen/Core>
#include <optional>

#include "feeler/core/task.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::execution {

/// True if the tool may have slipped into the opening while it probed: some hypothesis of the start belief has its
/// mouth over the tool (across the insertion within a cell and a quarter), less deep than the insertion.
bool MayHaveFallenIn(const Task& task, const planner::Problem& problem, const Eigen::Vector3d& tool);

/// A tool that stands inside has a wall of the opening no farther off than this, in cells: what the clearance allows is
/// at least the tolerance, and a motion that falls short of its end by less tells of no wall.
double FarthestWallInside(const Task& task, const Mover& mover);

/// Policies are planned with the opening closed; the real one is open. A tool that fell in is localized better than by
/// any probe: it feels the walls of the opening on both sides of both axes across the insertion, then comes out and
/// touches the face beside the mouth. Returns the position of the target (lattice coordinates), or nothing if there
/// are no walls on both sides: then the tool is where it was.
std::optional<Eigen::Vector3d> LocateFromInside(const Task& task, const planner::Problem& problem, Mover& mover);

}  // namespace feeler::execution
