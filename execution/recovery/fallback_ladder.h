#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "feeler/execution/lattice/attempt.h"

namespace feeler::execution {

/// The rungs, by the names under which records and summaries count them.
namespace rung {
inline constexpr const char* kRefit = "refit";                    ///< where is it, given everything felt?
inline constexpr const char* kInsertOnRefit = "insert on refit";  ///< the refit is narrow enough
inline constexpr const char* kYawFit = "yaw fit";            ///< feels how far the target is turned, and its middle
inline constexpr const char* kYawSweep = "yaw sweep";        ///< tries turns
inline constexpr const char* kSpiral = "spiral";             ///< slides on the face around the opening
inline constexpr const char* kResolve = "re-solve";          ///< plans online for what the refit leaves
inline constexpr const char* kWholeCuboid = "whole cuboid";  ///< forgets everything, and looks around it as well
inline constexpr const char* kGiveUp = "give up";
}  // namespace rung

/// What is tried when an attempt has failed, until the tool is inserted or nothing is left to try:
///
///   repeat three times:
///     if the insertion is blocked: yaw fit
///     if the target is not there, and was not felt to be turned:
///       refit over the touches of the attempt, in the start belief and around it (a quarter of the task's uncertainty)
///       if no place explains them: yaw fit
///       else if it is narrow enough: confirm and insert; if that is blocked: yaw fit
///     if the insertion is blocked: yaw sweep; spiral
///     new attempt: first with the hypotheses around the refit, turned as the target was felt to be, then with the
///       whole cuboid and a margin
///   give up
///
/// Each rung that is used is logged in the record, with what brought it about. Returns the reason of the episode's
/// end ("inserted", or why not). Throws ExecutionFailure when the robot fails or time is over.
std::string ClimbLadder(const Episode& episode, const planner::Problem& problem, const Pose& world_T_estimate,
                        Attempt attempt);

}  // namespace feeler::execution
