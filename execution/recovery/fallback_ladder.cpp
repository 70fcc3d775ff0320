#include "feeler/execution/recovery/fallback_ladder.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "feeler/execution/contact/insertion.h"
#include "feeler/execution/contact/spiral_search.h"
#include "feeler/execution/contact/wall_touch.h"
#include "feeler/execution/lattice/yaw_fit.h"
#include "feeler/execution/recovery/online_planner.h"
#include "feeler/planner/family/problem_family.h"

namespace feeler::execution {
namespace {

/// A refit with axes wider than this, to both sides, needs a plan; below, the confirming touches find it.
constexpr double kNarrow_m = 0.004;
constexpr int kRetries = 2;
constexpr double kDegree = std::numbers::pi / 180.0;
/// A turn smaller than this is not worth turning the frame for.
constexpr double kSmallestTurn_rad = 0.2 * kDegree;
/// Turns that are tried lie this many tolerances apart: each catches what is within one of it, and a little overlaps.
constexpr double kSweepStep = 1.5;
/// Beyond this a turn shows in the readings.
constexpr double kSweepMost_rad = 6.0 * kDegree;
/// The middle of a target that is not turned is felt this near to where it is believed, cells.
constexpr double kCentreOff = 1.25;
/// Of a start belief along an axis, as problems are made for.
constexpr int kMostCells = 64;
constexpr const char* kNoSides = "yaw fit: the sides of the target are not where they should be";
/// The tool comes off the mouth by this before it goes elsewhere, cells.
constexpr double kOff = 1.5;

void Log(const Episode& episode, const char* rung, std::string reason) {
  episode.record.FallBack(rung, std::move(reason));
}

Mover MoverFor(const Episode& episode, const LatticeFrame& frame) {
  return {episode.robot, frame, episode.task.insertion, episode.options, episode.record, episode.started_s};
}

/// Off whatever the tool stands on, straight out of the opening.
void ComeOff(const Task& task, const Eigen::Vector3d& target, Mover& mover) {
  const int axis = AxisOf(task.insertion);
  const double out = -SignOf(task.insertion);
  Eigen::Vector3d place = mover.position();
  const double height = target[axis] + out * kOff;
  if (out * (height - place[axis]) > 0.0) place[axis] = height;
  mover.Retreat(place);
}

/// Rungs 1 and 2. Leaves the attempt blocked where an insertion is, or where the touches agree on no place.
void Refit(const Episode& episode, const planner::Problem& problem, Attempt& attempt) {
  if (attempt.evidence.empty()) return;
  const Task& task = episode.task;
  Log(episode, rung::kRefit, attempt.reason);
  const Eigen::Vector3d beyond = CellsBeyond(task).cast<double>();
  const Region region{attempt.possible.lower - beyond, attempt.possible.upper + beyond};
  const TargetFit fit = FitTargetAnywhere(*problem.map, attempt.evidence, region.lower, region.upper,
                                          attempt.orientation, episode.options.fit);
  attempt.target = fit.position;
  attempt.spread = fit.half_width;
  attempt.sure = false;
  attempt.astray = fit.violations > 0;
  if (attempt.astray) {
    // As for a turned target, which can be felt.
    attempt.end = AttemptEnd::kBlocked;
    return;
  }
  const double widest = 2.0 * fit.half_width.maxCoeff() * task.cell_m;
  if (widest > kNarrow_m) return;

  Log(episode, rung::kInsertOnRefit, fmt::format("spread {:.1f} mm", 1e3 * widest));
  Mover mover = MoverFor(episode, attempt.frame);
  try {
    const Eigen::Vector3d margin = fit.half_width + Eigen::Vector3d::Constant(1.0);
    const Region likely{(fit.position - margin).cwiseMax(region.lower), (fit.position + margin).cwiseMin(region.upper)};
    const TargetFit confirmed =
        Confirm(*problem.map, task.insertion, attempt.orientation, likely, region, mover, attempt.evidence);
    attempt.target = confirmed.position;
    attempt.spread = confirmed.half_width;
    attempt.sure = IsSure(task, confirmed);
    RecordEstimate(episode, attempt.frame, confirmed);
    Conclude(episode, attempt.frame, confirmed.position,
             ApproachAndInsert(task, *problem.map, confirmed.position, attempt.orientation, mover, attempt.evidence),
             attempt);
  } catch (const LostTrack& lost) {
    attempt.end = AttemptEnd::kLost;
    attempt.reason = lost.what();
  }
}

/// Inserts with the tool turned by `yaw_rad` about the target.
bool InsertTurned(const Episode& episode, const planner::Problem& problem, double yaw_rad, Attempt& attempt) {
  const LatticeFrame turned = TurnedFrame(attempt.frame, episode.task.insertion, *attempt.target, yaw_rad);
  Mover mover = MoverFor(episode, turned);
  ComeOff(episode.task, Eigen::Vector3d::Zero(), mover);
  std::vector<Touch> ignored;
  Attempt trial = attempt;
  Conclude(episode, turned, Eigen::Vector3d::Zero(),
           ApproachAndInsert(episode.task, *problem.map, Eigen::Vector3d::Zero(), attempt.orientation, mover, ignored),
           trial);
  if (trial.end == AttemptEnd::kInserted) attempt = std::move(trial);
  return attempt.end == AttemptEnd::kInserted;
}

/// How far from the middle of the target, across the insertion, the farthest of its contacts was, cells.
double FarthestContact(const Task& task, const Attempt& attempt) {
  double farthest = 0.0;
  for (const Touch& touch : attempt.evidence) {
    if (!touch.contact) continue;
    Eigen::Vector3d across = touch.end() - *attempt.target;
    across[AxisOf(task.insertion)] = 0.0;
    farthest = std::max(farthest, across.norm());
  }
  return farthest;
}

/// What was felt along the insertion, in a frame that is turned about it; what was felt across it is along no axis of
/// that frame.
std::vector<Touch> TurnedEvidence(const Task& task, const Attempt& attempt, const LatticeFrame& turned) {
  std::vector<Touch> evidence;
  for (Touch touch : attempt.evidence) {
    if (touch.is_oblique() || AxisOf(touch.direction) != AxisOf(task.insertion)) continue;
    touch.start = turned.FromWorld(attempt.frame.ToWorld(touch.start));
    evidence.push_back(touch);
  }
  return evidence;
}

/// Feels where the sides of the target are, and inserts: of each axis first the nearest side, then, if that was not
/// good enough, both. Leaves the attempt lost, to look `slack` cells around, if a side is not there.
void InsertRecentred(const Episode& episode, const planner::Problem& problem, double slack, Attempt& attempt) {
  const Task& task = episode.task;
  const planner::ContactMap& map = *problem.map;
  Mover mover = MoverFor(episode, attempt.frame);
  mover.TrustAgain();  // the turn is what was not known
  for (const Sides sides : {Sides::kNearest, Sides::kBoth}) {
    const auto centre = Recenter(task, map, *attempt.target, attempt.orientation, sides, slack, mover);
    Eigen::Vector3d spread = Eigen::Vector3d::Constant(centre ? 0.1 : slack);
    spread[AxisOf(task.insertion)] = 0.1;
    if (centre) attempt.target = centre;
    attempt.possible = {*attempt.target - spread.cwiseMax(1.0), *attempt.target + spread.cwiseMax(1.0)};
    attempt.spread = spread;
    attempt.sure = centre.has_value();
    if (!centre) {
      attempt.end = AttemptEnd::kLost;
      attempt.reason = kNoSides;
      return;
    }
    Conclude(episode, attempt.frame, *centre,
             ApproachAndInsert(task, map, *centre, attempt.orientation, mover, attempt.evidence), attempt);
    if (attempt.end != AttemptEnd::kBlocked) return;
    if (sides == Sides::kNearest) ComeOff(task, *centre, mover);
  }
}

/// A side along each axis, wherever the target may be. False, with the attempt lost, if there is none.
bool FindSides(const Task& task, const planner::ContactMap& map, Mover& mover, Attempt& attempt) {
  const Eigen::Vector3d beyond = CellsBeyond(task).cast<double>();
  Eigen::Vector3d farthest =
      (*attempt.target - attempt.possible.lower + beyond).cwiseMax(attempt.possible.upper + beyond - *attempt.target);
  farthest[AxisOf(task.insertion)] = 0.0;
  const auto centre =
      Recenter(task, map, *attempt.target, attempt.orientation, Sides::kNearest, farthest.maxCoeff(), mover);
  if (centre) {
    attempt.target = centre;
    return true;
  }
  attempt.end = AttemptEnd::kLost;
  attempt.reason = kNoSides;
  return false;
}

/// Feels how far the target is turned; from then on the frame of the attempt is turned with it. Leaves the attempt lost
/// if the touches do not find the target where it is believed.
void FitYaw(const Episode& episode, const planner::Problem& problem, Attempt& attempt) {
  const Task& task = episode.task;
  const planner::ContactMap& map = *problem.map;
  Mover mover = MoverFor(episode, attempt.frame);
  if (const auto outmost = Outmost(task, map, attempt)) {
    mover.KeepClearOf((*attempt.target)[AxisOf(task.insertion)] + *outmost);
  }
  ComeOff(task, *attempt.target, mover);
  if (attempt.astray && !FindSides(task, map, mover, attempt)) return;
  const std::optional<YawFit> fit =
      MeasureYaw(task, map, *attempt.target, attempt.orientation, mover, attempt.evidence);
  const bool sound = fit && std::abs(fit->yaw_rad) <= kLargestTurn_rad;
  Log(episode, rung::kYawFit,
      sound ? fmt::format("{}; measured {:.2f} deg", attempt.reason, fit->yaw_rad / kDegree)
            : attempt.reason + "; no wall tells");
  if (!sound) {
    if (!attempt.tried) {
      Conclude(episode, attempt.frame, *attempt.target,
               ApproachAndInsert(task, map, *attempt.target, attempt.orientation, mover, attempt.evidence), attempt);
    }
    // Where everything else agrees the place is right, and turns can still be tried.
    if (!attempt.sure && attempt.end == AttemptEnd::kBlocked) attempt.end = AttemptEnd::kLost;
    return;
  }
  const double yaw_rad = std::abs(fit->yaw_rad) < kSmallestTurn_rad ? 0.0 : fit->yaw_rad;
  const LatticeFrame turned = TurnedFrame(attempt.frame, task.insertion, *attempt.target, yaw_rad);
  // The farther from the middle of a turned target a touch was, the more it is off.
  const double slack = kCentreOff + FarthestContact(task, attempt) * std::tan(std::abs(yaw_rad));
  // From here on the attempt is one in the turned frame.
  attempt.evidence = TurnedEvidence(task, attempt, turned);
  attempt.frame = turned;
  attempt.turned = true;
  attempt.target = fit->middle;
  attempt.tried = false;
  InsertRecentred(episode, problem, slack, attempt);
}

void SweepYaw(const Episode& episode, const planner::Problem& problem, Attempt& attempt) {
  Log(episode, rung::kYawSweep, attempt.reason);
  const double step_rad = kSweepStep * episode.task.tolerance.Angle(AxisOf(episode.task.insertion));
  for (double yaw_rad = step_rad; yaw_rad < kSweepMost_rad; yaw_rad += step_rad) {
    if (InsertTurned(episode, problem, yaw_rad, attempt) || InsertTurned(episode, problem, -yaw_rad, attempt)) return;
  }
}

void Spiral(const Episode& episode, const planner::Problem& problem, Attempt& attempt) {
  Log(episode, rung::kSpiral, attempt.reason);
  Mover mover = MoverFor(episode, attempt.frame);
  ComeOff(episode.task, *attempt.target, mover);
  const auto found = FindBySpiral(episode.task, *attempt.target, {}, mover);
  if (!found) {
    attempt.end = AttemptEnd::kLost;
    attempt.reason = "spiral: no opening found";
    return;
  }
  const double farthest_inside = FarthestInside(episode.task, *problem.map, attempt.orientation, episode.task.cell_m);
  Conclude(episode, attempt.frame, found->target,
           found->at_bottom ? BelievedInsertion{true, false, "inserted"}
                            : InsertFromHere(episode.task, found->target, farthest_inside, mover),
           attempt);
}

/// Carries out a rung on an insertion that is blocked.
void AtMouth(void (*rung)(const Episode&, const planner::Problem&, Attempt&), const Episode& episode,
             const planner::Problem& problem, Attempt& attempt) {
  if (attempt.end != AttemptEnd::kBlocked) return;
  try {
    rung(episode, problem, attempt);
  } catch (const LostTrack& lost) {
    attempt.end = AttemptEnd::kLost;
    attempt.reason = lost.what();
  }
}

/// Out of the opening, over the start pose of the problem, and down to it. `outmost`: where the target stands in the
/// middle of the hypotheses, as far as that was felt.
void GoToStart(const Episode& episode, const planner::Problem& problem, const LatticeFrame& frame,
               const std::optional<double>& outmost) {
  Mover mover = MoverFor(episode, frame);
  if (outmost) mover.KeepClearOf(frame.center[AxisOf(episode.task.insertion)] + *outmost);
  const int axis = AxisOf(episode.task.insertion);
  const double out = -SignOf(episode.task.insertion);
  const Eigen::Vector3d start = problem.start.cast<double>() + problem.map->phase();
  Eigen::Vector3d up = mover.position();
  up[axis] = out * std::max(out * up[axis] + 1.0, out * start[axis]);
  mover.Retreat(up);
  Eigen::Vector3d over = start;
  over[axis] = up[axis];
  if ((over - up).norm() > 0.05 && mover.Fast(over, "transfer").contact) {
    throw ExecutionFailure("ladder: contact on the way back to the start");
  }
  if ((start - over).norm() > 0.05 && mover.Fast(start, "transfer").contact) {
    throw ExecutionFailure("ladder: contact at the start of the new attempt");
  }
}

int CellsFor(double half_width, int most) {
  return std::clamp(2 * static_cast<int>(std::ceil(half_width + 0.5)) + 1, 3, std::max(3, most));
}

/// The next attempt; empty if no policy for it was found.
std::optional<Attempt> NewAttempt(const Episode& episode, const planner::Problem& like, const Pose& world_T_estimate,
                                  const planner::Extents& extents, const std::optional<double>& outmost,
                                  OnlinePlanner& planner) {
  const planner::Problem problem = planner::MakeCuboidProblem(episode.task, like.map, extents);
  const std::unique_ptr<policies::Policy> policy = planner.PolicyFor(problem);
  if (!policy) return std::nullopt;
  GoToStart(episode, problem, FrameOf(episode.task, problem, world_T_estimate), outmost);
  return RunAttempt(episode, problem, world_T_estimate, *policy, outmost);
}

/// Hypotheses along each axis of the task (1 where it is certain) around a refit.
planner::Extents ExtentsAround(const Task& task, const Eigen::Vector3d& spread) {
  const Cell largest = LargestPositionExtents(task);
  int counts[3];
  for (int axis = 0; axis < 3; ++axis) counts[axis] = CellsFor(spread[axis], largest[axis]);
  return {counts[0], counts[1], counts[2]};
}

planner::Extents WithMargin(const Task& task, const planner::Problem& problem) {
  Cell least = problem.hypotheses.front().offset;
  Cell most = least;
  for (const planner::Hypothesis& h : problem.hypotheses) {
    least = least.cwiseMin(h.offset);
    most = most.cwiseMax(h.offset);
  }
  const Cell size = (most - least + Cell::Ones() + 2 * CellsBeyond(task)).cwiseMin(kMostCells);
  return {size.x(), size.y(), size.z()};
}

}  // namespace

std::string ClimbLadder(const Episode& episode, const planner::Problem& problem, const Pose& world_T_estimate,
                        Attempt attempt) {
  std::shared_ptr<OnlinePlanner> planner = episode.options.online_planner;
  if (!planner) planner = std::make_shared<OnlinePlanner>();
  for (int retry = 0;; ++retry) {
    // First what takes no other place to be right: touches of a turned target do not agree on one, either.
    AtMouth(FitYaw, episode, problem, attempt);
    if (attempt.end == AttemptEnd::kLost && !attempt.turned) {
      Refit(episode, problem, attempt);
      AtMouth(FitYaw, episode, problem, attempt);
    }
    AtMouth(SweepYaw, episode, problem, attempt);
    AtMouth(Spiral, episode, problem, attempt);
    if (attempt.end == AttemptEnd::kInserted) return attempt.reason;
    if (retry == kRetries) break;

    std::optional<Attempt> next;
    if (retry == 0 && attempt.target) {
      Log(episode, rung::kResolve, attempt.reason);
      next = NewAttempt(episode, problem, attempt.frame.ToWorld(*attempt.target),
                        ExtentsAround(episode.task, attempt.spread), Outmost(episode.task, *problem.map, attempt),
                        *planner);
    } else {
      Log(episode, rung::kWholeCuboid, attempt.reason);
      next = NewAttempt(episode, problem, world_T_estimate, WithMargin(episode.task, problem), std::nullopt, *planner);
    }
    if (!next) {
      attempt.end = AttemptEnd::kLost;
      attempt.reason = "ladder: no policy within the budget";
      continue;
    }
    attempt = std::move(*next);
    if (attempt.end == AttemptEnd::kInserted) return attempt.reason;
  }
  Log(episode, rung::kGiveUp, attempt.reason);
  return attempt.reason;
}

}  // namespace feeler::execution
