#pragma once

#include <Eigen/Core>
#include <optional>

#include "feeler/core/task.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::execution {

/// From this far above a mouth on the tool may be in its opening, cells: to the nearest hypothesis.
inline constexpr double kAtMouth = -0.5;

/// The tool may have slipped into the opening while it probed: some hypothesis of the start belief has its mouth over
/// the tool (across the insertion within a cell and a quarter), less deep than the insertion.
/// How deep in an opening the tool may stand, cells: under the highest of those mouths; empty if there is none.
std::optional<double> DeepestInside(const Task& task, const planner::Problem& problem, const Eigen::Vector3d& tool);
/// True if that is deeper than `least_depth`.
bool MayHaveFallenIn(const Task& task, const planner::Problem& problem, const Eigen::Vector3d& tool,
                     double least_depth = kAtMouth);

/// A tool that stands inside has a wall of the opening no farther off than this, in cells: what the clearance allows is
/// at least the tolerance, and a motion that falls short of its end by less tells of no wall.
double FarthestWallInside(const Task& task, const Mover& mover);

/// Policies are planned with the opening closed; the real one is open. A tool that fell in is localized better than by
/// any probe: it feels the walls of the opening on both sides of both axes across the insertion, then comes out and
/// touches the face beside the mouth. Returns the position of the target (lattice coordinates), or nothing if there
/// are no walls on both sides: then the tool is where it was.
std::optional<Eigen::Vector3d> LocateFromInside(const Task& task, const planner::Problem& problem, Mover& mover);

}  // namespace feeler::execution
