#include "feeler/execution/lattice/attempt.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <variant>

#include "feeler/core/orientation_lattice.h"
#include "feeler/execution/contact/insertion.h"
#include "feeler/execution/contact/servoing.h"
#include "feeler/execution/contact/spiral_search.h"
#include "feeler/execution/lattice/localizer.h"

namespace feeler::execution {
namespace {

/// How far outside the start belief a truth is looked for, per axis: this much of the largest uncertainty that the task
/// knows. What estimates where targets are is wrong by more than it says in proportion to what it says.
constexpr double kBeyondUncertainty = 0.25;

Region HullOf(const std::vector<planner::Hypothesis>& hypotheses) {
  Region hull{hypotheses.front().offset.cast<double>(), hypotheses.front().offset.cast<double>()};
  for (const planner::Hypothesis& h : hypotheses) {
    hull.lower = hull.lower.cwiseMin(h.offset.cast<double>());
    hull.upper = hull.upper.cwiseMax(h.offset.cast<double>());
  }
  return hull;
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

/// Spirals around the middle of the hypotheses left, and inserts where the tool drops in.
void SearchAndInsert(const Episode& episode, const planner::ContactMap& map, const policies::SpiralSearch& search,
                     Mover& mover, Attempt& attempt) {
  const Task& task = episode.task;
  ExecutionRecord& record = episode.record;
  for (const double value : {search.radius_m, search.pitch_m, search.speed_m_s, search.press_n, search.face_range_m}) {
    if (!(std::isfinite(value) && value > 0.0)) throw ExecutionFailure("policy: a spiral that is no sensible number");
  }
  if (search.radius_m > 1.0 || search.radius_m / search.pitch_m > 1e4) {
    throw ExecutionFailure("policy: a spiral without an end");
  }
  const auto found = FindBySpiral(task, *attempt.target, search, mover);
  record.localization_time_s = episode.robot.Time() - episode.started_s;
  if (!found) {
    attempt.end = AttemptEnd::kLost;
    attempt.reason = "spiral: no opening found";
    return;
  }
  attempt.target = found->target;
  record.believed_localized = true;
  record.world_T_estimate = attempt.frame.ToWorld(found->target);
  const double farthest_inside = FarthestInside(task, map, attempt.orientation, task.cell_m);
  const BelievedInsertion verdict = found->at_bottom ? BelievedInsertion{true, false, "inserted"}
                                                     : InsertFromHere(task, found->target, farthest_inside, mover);
  record.believed_inserted = verdict.inserted;
  attempt.reason = verdict.reason;
  attempt.end = verdict.inserted ? AttemptEnd::kInserted : AttemptEnd::kBlocked;
}

/// No place of a target that is not turned, in the start belief or around it, explains what was felt.
bool IsFeltTurned(const Episode& episode, const planner::ContactMap& map, const Attempt& attempt) {
  const Eigen::Vector3d beyond = CellsBeyond(episode.task).cast<double>();
  return FitTargetAnywhere(map, attempt.evidence, attempt.possible.lower - beyond, attempt.possible.upper + beyond,
                           attempt.orientation, episode.options.fit)
             .violations > 0;
}

/// Fills the attempt step by step, so that what was reached stands in it after a failure.
void LocalizeAndInsert(const Episode& episode, const planner::Problem& problem, policies::Policy& policy, Mover& mover,
                       Attempt& attempt) {
  const Task& task = episode.task;
  ExecutionRecord& record = episode.record;
  Localizer localizer(task, problem, policy, mover, record);
  policies::Decision decision;
  try {
    decision = localizer.Run();
  } catch (const ExecutionFailure&) {
    attempt.evidence = localizer.evidence();
    throw;
  }
  const std::vector<TrackedHypothesis>& left = localizer.hypotheses();
  attempt.orientation = left.front().hypothesis.orientation;
  attempt.evidence = localizer.evidence();
  attempt.target = Mean(left);
  if (const auto* search = std::get_if<policies::SpiralSearch>(&decision)) {
    return SearchAndInsert(episode, *problem.map, *search, mover, attempt);
  }
  if (std::holds_alternative<policies::Servo>(decision)) {
    decision = FollowByEye(problem, decision, policy, mover, record);
  }
  const auto* wanted = std::get_if<policies::Insert>(&decision);
  if (wanted == nullptr) throw ExecutionFailure("policy: neither inserts nor gives up after it has looked");
  const policies::Insert& insert = *wanted;
  if (insert.tool_T_target) {
    attempt.target = mover.Locate(*insert.tool_T_target);
    record.believed_localized = true;
  } else if (localizer.found_inside()) {
    attempt.target = localizer.found_inside();
    attempt.sure = true;
    record.fell_in = true;
    record.believed_localized = true;
  } else if (insert.confirm) {
    const TargetFit fit = Confirm(*problem.map, task.insertion, attempt.orientation,
                                  LikelyRegion(left, attempt.possible), attempt.possible, mover, attempt.evidence);
    attempt.target = fit.position;
    attempt.sure = IsSure(task, fit);
    RecordEstimate(episode, attempt.frame, fit);
  }
  record.world_T_estimate = attempt.frame.ToWorld(*attempt.target);
  record.localization_time_s = episode.robot.Time() - episode.started_s;
  if (episode.options.ladder && insert.confirm && record.careful && IsFeltTurned(episode, *problem.map, attempt)) {
    // Touches of a turned target agree on no place. What turns it is felt sooner than an insertion fails.
    attempt.end = AttemptEnd::kBlocked;
    attempt.reason = "touches that agree on no place";
    return;
  }
  if (const auto outmost = Outmost(task, *problem.map, attempt)) {
    mover.KeepClearOf((*attempt.target)[AxisOf(task.insertion)] + *outmost);
  }
  const BelievedInsertion verdict =
      ApproachAndInsert(task, *problem.map, *attempt.target, attempt.orientation, mover, attempt.evidence);
  const bool localized = record.believed_localized;
  Conclude(episode, attempt.frame, *attempt.target, verdict, attempt);
  record.believed_localized = localized;  // without touches that confirm, no more than the policy believes
}

}  // namespace

Cell CellsBeyond(const Task& task) {
  const Cell largest = LargestPositionExtents(task);
  Cell beyond;
  for (int axis = 0; axis < 3; ++axis) {
    beyond[axis] = largest[axis] > 1 ? static_cast<int>(std::ceil(kBeyondUncertainty * largest[axis])) : 0;
  }
  // An axis that counts as certain is off by a little of what the others are.
  return beyond.cwiseMax(1);
}

std::optional<double> Outmost(const Task& task, const planner::ContactMap& map, const Attempt& attempt) {
  if (!attempt.target) return std::nullopt;
  const bool felt = std::any_of(attempt.evidence.begin(), attempt.evidence.end(), [&](const Touch& touch) {
    return touch.contact && !touch.is_oblique() && touch.direction == task.insertion;
  });
  if (!felt) return std::nullopt;
  constexpr double kRoom = 1.5;  // what is blocked ends within a cell of the last that is
  const int axis = AxisOf(task.insertion);
  const int out = -SignOf(task.insertion);
  const CellBox& box = map.domain();
  for (int place = out > 0 ? box.max[axis] : box.min[axis]; box.min[axis] <= place && place <= box.max[axis];
       place -= out) {
    Cell least = box.min;
    Cell most = box.max;
    least[axis] = most[axis] = place;
    for (int x = least.x(); x <= most.x(); ++x) {
      for (int y = least.y(); y <= most.y(); ++y) {
        for (int z = least.z(); z <= most.z(); ++z) {
          if (map.Blocked({x, y, z}, attempt.orientation)) {
            return place + map.phase()[axis] + out * kRoom;
          }
        }
      }
    }
  }
  return std::nullopt;
}

void Conclude(const Episode& episode, const LatticeFrame& frame, const Eigen::Vector3d& target,
              const BelievedInsertion& verdict, Attempt& attempt) {
  episode.record.world_T_estimate = frame.ToWorld(target);
  episode.record.believed_localized = true;
  episode.record.believed_inserted = verdict.inserted;
  attempt.tried = true;
  attempt.reason = verdict.reason;
  attempt.end = verdict.inserted ? AttemptEnd::kInserted : verdict.blocked ? AttemptEnd::kBlocked : AttemptEnd::kLost;
}

bool IsSure(const Task& task, const TargetFit& fit) {
  if (fit.violations > 0) return false;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis != AxisOf(task.insertion) && !fit.pinned[static_cast<std::size_t>(axis)]) return false;
  }
  return true;
}

LatticeFrame FrameOf(const Task& task, const planner::Problem& problem, const Pose& world_T_estimate) {
  const Region hull = HullOf(problem.hypotheses);
  // The estimate is the centre of the chosen angles, which may lie half a step beside the frame
  // (orientation_lattice.h).
  std::vector<int> extents;
  for (const UncertainAxis& axis : task.axes) {
    std::set<int> places;
    const int pitches = LatticeAngles(task, AxisKind::kPitch);
    for (const planner::Hypothesis& h : problem.hypotheses) {
      if (axis.kind == AxisKind::kYaw) places.insert(h.orientation / pitches);
      if (axis.kind == AxisKind::kPitch) places.insert(h.orientation % pitches);
    }
    extents.push_back(std::max(1, static_cast<int>(places.size())));
  }
  Pose world_T_frame = world_T_estimate;
  if (LatticeOrientations(task) > 1) {
    world_T_frame.linear() = world_T_estimate.linear() * FrameREstimate(task, extents).inverse().toRotationMatrix();
  }
  return {world_T_frame, 0.5 * (hull.lower + hull.upper), task.cell_m};
}

void RecordEstimate(const Episode& episode, const LatticeFrame& frame, const TargetFit& fit) {
  ExecutionRecord& record = episode.record;
  record.violations = fit.violations;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    record.half_width_m[i] = fit.pinned[i] ? 0.0 : fit.half_width[axis] * frame.cell_m;
  }
  record.believed_localized = true;
  record.world_T_estimate = frame.ToWorld(fit.position);
}

Attempt RunAttempt(const Episode& episode, const planner::Problem& problem, const Pose& world_T_estimate,
                   policies::Policy& policy, std::optional<double> outmost) {
  Attempt attempt;
  attempt.frame = FrameOf(episode.task, problem, world_T_estimate);
  attempt.possible = PossibleRegion(problem);
  const Direction insertion = episode.task.insertion;
  Mover mover(episode.robot, attempt.frame, insertion, episode.options, episode.record, episode.started_s);
  if (const policies::Doubt* doubt = policy.doubt()) mover.DoubtReadings(doubt->steps_get_lost());
  if (outmost) mover.KeepClearOf(attempt.frame.center[AxisOf(insertion)] + *outmost);
  const Eigen::Vector3d start = problem.start.cast<double>() + problem.map->phase();
  const double off = (mover.position() - start).cwiseAbs().maxCoeff();
  if (off > 0.5) {
    throw ExecutionFailure(
        fmt::format("start: the tool is {:.2f} mm from the start pose", 1e3 * off * attempt.frame.cell_m));
  }
  mover.ZeroWrench();
  try {
    LocalizeAndInsert(episode, problem, policy, mover, attempt);
  } catch (const LostTrack& lost) {
    attempt.end = AttemptEnd::kLost;
    attempt.reason = lost.what();
  }
  return attempt;
}

}  // namespace feeler::execution
