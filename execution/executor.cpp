#include "feeler/execution/executor.h"

#include <algorithm>
#include <exception>
#include <string>

#include "feeler/core/error.h"
#include "feeler/execution/lattice/attempt.h"
#include "feeler/execution/pose/pose_attempt.h"
#include "feeler/execution/recovery/fallback_ladder.h"

namespace feeler::execution {
namespace {

void Check(const Task& task, const planner::Problem& problem) {
  if (!problem.map || problem.hypotheses.empty()) {
    throw InputError("executor", "the problem has no contact map or no hypothesis",
                     "give a problem made by MakeCuboidProblem");
  }
  if (!(task.cell_m > 0.0))
    throw InputError("executor", "the cell size of the task is not positive", "give a positive resolution");
}

/// Nothing was ever touched: what is believed of the target was never compared with it, and there may be none.
void DoubtUntouched(const ExecutorOptions& options, ExecutionRecord& record) {
  const auto touched = [&](const MoveRecord& move) {
    return move.contact || move.peak_force_n >= options.contact_force_n;
  };
  if (std::any_of(record.moves.begin(), record.moves.end(), touched)) return;
  if (record.believed_inserted) record.reason = "no contact was met: is the target there?";
  record.believed_inserted = record.believed_localized = false;
}

}  // namespace

Pose LatticeStartPose(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate) {
  Check(task, problem);
  return FrameOf(task, problem, world_T_estimate).ToWorld(problem.start.cast<double>() + problem.map->phase());
}

ExecutionRecord Execute(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate,
                        policies::Policy& policy, Robot& robot, const ExecutorOptions& options) {
  Check(task, problem);
  Validate(options);
  ExecutionRecord record;
  const Episode episode{task, robot, options, record, robot.Time()};
  try {
    if (HasAngles(problem) && options.travel_model) {
      record.reason = RunPoseAttempt(episode, problem, world_T_estimate, policy, *options.travel_model);
    } else {
      const Attempt attempt = RunAttempt(episode, problem, world_T_estimate, policy);
      record.reason = attempt.reason;
      if (options.ladder && attempt.end != AttemptEnd::kInserted) {
        record.reason = ClimbLadder(episode, problem, world_T_estimate, attempt);
      }
    }
    DoubtUntouched(options, record);
  } catch (const ExecutionFailure& failure) {
    record.reason = failure.what();
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    record.reason = std::string("exception: ") + error.what();
  }
  record.sim_time_s = robot.Time() - episode.started_s;
  return record;
}

}  // namespace feeler::execution
