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

Region HullOf(const std::vector<planner::Hypothesis>& hypotheses) {
  Region hull{hypotheses.front().offset.cast<double>(), hypotheses.front().offset.cast<double>()};
  for (const planner::Hypothesis& h : hypotheses) {
    hull.lower = hull.lower.cwiseMin(h.offset.cast<double>());
    hull.upper = hull.upper.cwiseMax(h.offset.cast<double>());
  }
  return hull;
}

LatticeFrame FrameOf(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate) {
  const Region hull = HullOf(problem.hypotheses);
  return {world_T_estimate, 0.5 * (hull.lower + hull.upper), task.cell_m};
}

/// Where a truth that belongs to the start belief may be: uniform in the lattice span plus half a cell each side, and a
/// little for errors of measurement.
Region PossibleRegion(const planner::Problem& problem) {
  constexpr double kBeyondSpan = 0.6;
  Region region = HullOf(problem.hypotheses);
  region.lower.array() -= kBeyondSpan;
  region.upper.array() += kBeyondSpan;
  return region;
}

/// A cell around the hypotheses left.
Region LikelyRegion(const std::vector<TrackedHypothesis>& left, const Region& possible) {
  Region region{left.front().position(), left.front().position()};
  for (const TrackedHypothesis& t : left) {
    region.lower = region.lower.cwiseMin(t.position());
    region.upper = region.upper.cwiseMax(t.position());
  }
  const auto clamp = [&](const Eigen::Vector3d& u) {
    return u.cwiseMax(possible.lower).cwiseMin(possible.upper).eval();
  };
  return {clamp(region.lower - Eigen::Vector3d::Ones()), clamp(region.upper + Eigen::Vector3d::Ones())};
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
    const Region possible = PossibleRegion(problem);
    const TargetFit fit =
        Confirm(*problem.map, task.insertion, orientation, LikelyRegion(left, possible), possible, mover, evidence);
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
