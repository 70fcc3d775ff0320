#include "execution/executor.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>

#include "core/error.h"
#include "execution/confirm.h"
#include "execution/contact_evidence.h"
#include "execution/insertion.h"
#include "execution/lattice_frame.h"
#include "execution/localizer.h"
#include "execution/mover.h"

namespace feeler::execution {
namespace {

struct Hull {
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();
};

Hull HullOf(const std::vector<planner::Hypothesis>& hypotheses) {
  Hull hull{hypotheses.front().offset.cast<double>(), hypotheses.front().offset.cast<double>()};
  for (const planner::Hypothesis& h : hypotheses) {
    hull.lower = hull.lower.cwiseMin(h.offset.cast<double>());
    hull.upper = hull.upper.cwiseMax(h.offset.cast<double>());
  }
  return hull;
}

LatticeFrame FrameOf(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate) {
  const Hull hull = HullOf(problem.hypotheses);
  return {world_T_estimate, 0.5 * (hull.lower + hull.upper), task.cell_m};
}

/// Where the target may be if it is near one of the hypotheses left: a cell around them, within the start belief.
Hull SearchBox(const std::vector<TrackedHypothesis>& left, const Hull& start) {
  Hull box{left.front().position(), left.front().position()};
  for (const TrackedHypothesis& t : left) {
    box.lower = box.lower.cwiseMin(t.position());
    box.upper = box.upper.cwiseMax(t.position());
  }
  // A truth uniform in the lattice span plus half a cell each side, and a little for errors of measurement.
  constexpr double kBeyondSpan = 0.6;
  const Eigen::Vector3d lowest = start.lower - Eigen::Vector3d::Constant(kBeyondSpan);
  const Eigen::Vector3d highest = start.upper + Eigen::Vector3d::Constant(kBeyondSpan);
  box.lower = (box.lower - Eigen::Vector3d::Ones()).cwiseMax(lowest).cwiseMin(highest);
  box.upper = (box.upper + Eigen::Vector3d::Ones()).cwiseMin(highest).cwiseMax(lowest);
  return box;
}

Eigen::Vector3d Mean(const std::vector<TrackedHypothesis>& tracked) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 0.0;
  for (const TrackedHypothesis& t : tracked) {
    sum += t.hypothesis.weight * t.position();
    weight += t.hypothesis.weight;
  }
  return sum / weight;
}

void Check(const Task& task, const planner::Problem& problem) {
  if (!problem.map || problem.hypotheses.empty()) {
    throw InputError("executor", "the problem has no contact map or no hypothesis");
  }
  if (!(task.cell_m > 0.0)) throw InputError("executor", "the cell size of the task is not positive");
}

/// Localizes, confirms, inserts; fills the record as it goes, so that what was reached stands in it after a failure.
void Run(const Task& task, const planner::Problem& problem, const LatticeFrame& frame, policies::Policy& policy,
         Robot& robot, const ExecutorOptions& options, ExecutionRecord& record) {
  const double started_s = robot.Time();
  Mover mover(robot, frame, options, record);
  const Eigen::Vector3d start = problem.start.cast<double>() + problem.map->phase();
  const double off = (mover.position() - start).cwiseAbs().maxCoeff();
  if (off > 0.5)
    throw ExecutionFailure(fmt::format("start: the tool is {:.2f} mm from the start pose", 1e3 * off * frame.cell_m));
  mover.ZeroWrench();

  Localizer localizer(task, problem, policy, mover, record);
  const policies::Insert insert = localizer.Run();
  const std::vector<TrackedHypothesis>& left = localizer.hypotheses();
  const int orientation = left.front().hypothesis.orientation;
  std::vector<Touch> evidence = localizer.evidence();
  Eigen::Vector3d target = Mean(left);
  if (localizer.found_inside()) {
    target = *localizer.found_inside();
    record.fell_in = true;
    record.localized = true;
  } else if (insert.confirm) {
    const Hull box = SearchBox(left, HullOf(problem.hypotheses));
    const TargetFit fit = Confirm(*problem.map, task.insertion, orientation, box.lower, box.upper, mover, evidence);
    target = fit.position;
    record.violations = fit.violations;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      record.half_width_m[i] = fit.pinned[i] ? 0.0 : fit.half_width[axis] * frame.cell_m;
    }
    record.localized = true;
  }
  record.world_T_estimate = frame.ToWorld(target);
  record.localization_time_s = robot.Time() - started_s;

  const InsertionVerdict verdict = ApproachAndInsert(task, *problem.map, target, orientation, mover, evidence);
  record.inserted = verdict.inserted;
  record.reason = verdict.reason;
}

}  // namespace

Pose StartPose(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate) {
  Check(task, problem);
  return FrameOf(task, problem, world_T_estimate).ToWorld(problem.start.cast<double>() + problem.map->phase());
}

ExecutionRecord Execute(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate,
                        policies::Policy& policy, Robot& robot, const ExecutorOptions& options) {
  Check(task, problem);
  Validate(options);
  const LatticeFrame frame = FrameOf(task, problem, world_T_estimate);
  ExecutionRecord record;
  const double started_s = robot.Time();
  try {
    Run(task, problem, frame, policy, robot, options, record);
  } catch (const ExecutionFailure& failure) {
    record.reason = failure.what();
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    record.reason = std::string("exception: ") + error.what();
  }
  record.sim_time_s = robot.Time() - started_s;
  return record;
}

}  // namespace feeler::execution
