#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/robot.h"
#include "feeler/core/task.h"
#include "feeler/execution/contact/confirm.h"
#include "feeler/execution/contact/contact_evidence.h"
#include "feeler/execution/contact/execution_record.h"
#include "feeler/execution/contact/executor_options.h"
#include "feeler/execution/contact/insertion.h"
#include "feeler/execution/contact/lattice_frame.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/policies/policy.h"

namespace feeler::execution {

/// What stays the same through all attempts of an episode.
struct Episode {
  const Task& task;
  Robot& robot;
  const ExecutorOptions& options;
  ExecutionRecord& record;
  double started_s = 0.0;
};

enum class AttemptEnd {
  kInserted,
  kLost,     ///< what was felt fits no hypothesis of the attempt
  kBlocked,  ///< the insertion met something in front of the opening
};

/// One localization of a start belief with the insertion after it, and what is known at its end.
struct Attempt {
  AttemptEnd end = AttemptEnd::kLost;
  std::string reason;
  LatticeFrame frame;
  Region possible;              ///< where the start belief says the target may be
  std::vector<Touch> evidence;  ///< in lattice coordinates of the frame
  std::optional<Eigen::Vector3d> target;
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();  ///< half width of what the last refit leaves, per axis, cells
  bool sure = false;    ///< the fit explains every touch, and a contact pins each axis across the insertion
  bool tried = false;   ///< the tool was pushed at the target
  bool astray = false;  ///< no place explains the touches: `target` is the one that explains most of them
  bool turned = false;  ///< the frame is turned as the target was felt to be: `spread` says how well it is placed
  int orientation = 0;
};

/// The lattice frame of a problem whose hypotheses have their centre at the estimate; its axes are those of the lattice
/// of orientations (core/orientation_lattice.h).
LatticeFrame FrameOf(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate);

/// Follows the policy from the start pose of the problem, confirms, inserts. Fills the record as it goes. Throws
/// ExecutionFailure for what no other plan can mend. `outmost`: how far out from the estimate, along the insertion,
/// anything of the target stands, cells, where that was felt (Mover::KeepClearOf).
Attempt RunAttempt(const Episode& episode, const planner::Problem& problem, const Pose& world_T_estimate,
                   policies::Policy& policy, std::optional<double> outmost = {});

/// How far out from its mouth anything of the target stands, along the axis of the insertion, a cell of room included;
/// known once a contact along the insertion has told how high the target stands.
std::optional<double> Outmost(const Task& task, const planner::ContactMap& map, const Attempt& attempt);

/// The fit explains every touch, and a contact pins each axis across the insertion.
bool IsSure(const Task& task, const TargetFit& fit);

/// Writes a fit into the record as the estimate.
void RecordEstimate(const Episode& episode, const LatticeFrame& frame, const TargetFit& fit);

/// Cells beyond the start belief, along each axis, in which a truth is looked for that it does not hold.
Cell CellsBeyond(const Task& task);

/// Takes over what an insertion in `frame` at `target` came to.
void Conclude(const Episode& episode, const LatticeFrame& frame, const Eigen::Vector3d& target,
              const BelievedInsertion& verdict, Attempt& attempt);

}  // namespace feeler::execution
