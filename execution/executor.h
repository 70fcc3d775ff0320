#pragma once

#include "feeler/core/pose.h"
#include "feeler/core/robot.h"
#include "feeler/core/task.h"
#include "feeler/execution/contact/execution_record.h"
#include "feeler/execution/contact/executor_options.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/policies/policy.h"

namespace feeler::execution {

/// Carries a policy out on a robot: localizes the target by touch, confirms axes that are still loose, inserts. This is
/// the bare policy with careful execution; nothing here replans.
///
/// `problem` is the start belief (its map and hypotheses); `world_T_estimate` the estimated pose of the target, at the
/// centre of the hypotheses. The tool must stand at the start pose: displaced from the estimate by
/// (problem.start + phase - centre) cells in the axes of the estimate, and parallel to it.
///
/// Failures of robot, policy or insertion end the execution; the reason stands in the record. Throws InputError only
/// for arguments that do not fit each other. Deterministic: the record is a function of the arguments and of what the
/// robot answers (`policy_cpu_s` excepted).
ExecutionRecord Execute(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate,
                        policies::Policy& policy, Robot& robot, const ExecutorOptions& options = {});

/// Where the tool stands at the start of `problem` (world pose).
Pose LatticeStartPose(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate);

}  // namespace feeler::execution
