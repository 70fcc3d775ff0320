#include "feeler/execution/contact/mover.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "feeler/execution/contact/force_budget.h"

namespace feeler::execution {
namespace {

/// Contact force that no motion reaches: a retreat starts in contact and must not stop for it.
constexpr double kUnwatched = 1e6;
/// Cosine between a way and a face's normal below which the tool passes by the face, and above which it meets no edge
/// beside it.
constexpr double kAcross = 0.1;
constexpr double kAlong = 0.9;
/// Ways after a surprise that are as slow as edges ask for: off it, and past it.
constexpr int kStartled = 2;
/// Of the budget: a force that stops a compliant motion rises on until the robot has stopped.
constexpr double kPressShare = 0.95;
/// A shorter way that is free is not worth a motion of its own, cells.
constexpr double kLeastFree = 1.0;
/// A target that stands higher than all hypotheses is met on the first way along the insertion, where contacts are
/// hardest: this costs a tenth of a second.
constexpr double kUnfelt_m_s = 0.08;

}  // namespace

std::optional<Direction> DirectionOf(const Eigen::Vector3d& motion) {
  int axis = 0;
  const double along = motion.cwiseAbs().maxCoeff(&axis);
  if (along <= 0.0) return std::nullopt;
  Eigen::Vector3d across = motion;
  across[axis] = 0.0;
  if (across.norm() > 0.1 * along) return std::nullopt;
  return MakeDirection(axis, motion[axis] < 0.0 ? -1 : 1);
}

Mover::Mover(Robot& robot, const LatticeFrame& frame, Direction insertion, const ExecutorOptions& options,
             ExecutionRecord& record, double started_s)
    : robot_(robot),
      frame_(frame),
      insertion_(insertion),
      options_(options),
      record_(record),
      start_time_s_(started_s),
      last_motion_end_s_(robot.Time()) {
  position_ = Measure(robot.ToolPose());
}

Eigen::Vector3d Mover::Measure(const Pose& world_T_tool) const {
  const Eigen::Vector3d u = frame_.FromWorld(world_T_tool);
  // Far beyond any workspace is as meaningless as NaN, and lattice arithmetic on it would overflow.
  if (!u.allFinite() || u.cwiseAbs().maxCoeff() > 1e6) {
    throw ExecutionFailure("robot: the measured tool pose is not a sensible number");
  }
  return u;
}

ContactResponse Mover::ContactAlong(const Eigen::Vector3d& direction, bool held) const {
  const ContactResponse told = robot_.Contact(frame_.world_T_estimate.linear() * direction);
  return held || direction.dot(UnitVector(insertion_)) > kAlong ? told.Held() : told;
}

double Mover::FaceMargin() const {
  constexpr double kErrors = 0.25;  // of tracking, and of the give of the contacts that have told of the face
  return std::min(options_.fast_margin_cells, std::max(Cells(options_.retreat_m), kErrors));
}

void Mover::CheckLimits() const {
  if (static_cast<int>(record_.moves.size()) >= options_.motion_limit) {
    throw ExecutionFailure(fmt::format("limit: {} motions without a verdict", options_.motion_limit));
  }
  const double elapsed = robot_.Time() - start_time_s_;
  if (!(elapsed <= options_.time_limit_s)) {
    throw ExecutionFailure(fmt::format("limit: {:.1f} s without a verdict", elapsed));
  }
}

MotionReport Mover::Finish(const MotionResult& result, const Eigen::Vector3d& target, const std::string& kind,
                           const PredictedCells& predicted, bool shortfall) {
  const Eigen::Vector3d before = position_;
  const Eigen::Vector3d motion = target - before;
  const double length = motion.norm();
  MotionReport report;
  report.end = Measure(result.world_T_tool);
  report.reason = result.reason;
  const double travelled = length > 0.0 ? (report.end - before).dot(motion) / length : 0.0;
  report.felt = result.contact || result.reason == StopReason::kContact;
  report.contact = report.felt || (shortfall && (length - travelled) * frame_.cell_m > options_.shortfall_m);

  MoveRecord move;
  move.kind = kind;
  if (const auto direction = DirectionOf(motion)) move.direction = ToString(*direction);
  move.commanded_m = length * frame_.cell_m;
  if (predicted) {
    move.predicted_m = {std::clamp((*predicted)[0], 0.0, length) * frame_.cell_m,
                        std::clamp((*predicted)[1], 0.0, length) * frame_.cell_m};
  }
  move.travelled_m = travelled * frame_.cell_m;
  move.contact = report.contact;
  move.peak_force_n = std::isfinite(result.peak_force_n) ? result.peak_force_n : 0.0;
  const double now_s = robot_.Time();
  move.duration_s = now_s - last_motion_end_s_;
  last_motion_end_s_ = now_s;
  record_.peak_force_n = std::max(record_.peak_force_n, move.peak_force_n);
  if (move.peak_force_n > options_.force_budget_n) ++record_.budget_passings;
  record_.path_length_m += (report.end - before).norm() * frame_.cell_m;
  record_.moves.push_back(std::move(move));
  if (options_.on_motion) options_.on_motion(record_);

  position_ = report.contact ? report.end : target;
  if (result.reason == StopReason::kAborted || result.reason == StopReason::kUnplanned) {
    throw ExecutionFailure(fmt::format("robot: {} motion {}{}{}", kind, ToString(result.reason),
                                       result.detail.empty() ? "" : ": ", result.detail));
  }
  return report;
}

MotionReport Mover::Fast(const Eigen::Vector3d& target, const std::string& kind, const PredictedCells& predicted,
                         FreeBy free_by) {
  constexpr int kMostFalse = 5;
  constexpr double kSamePlace = 0.3;
  constexpr double kComeOff = 0.5;
  const bool careful = record_.careful;
  const Eigen::Vector3d from = position_;
  // Where all ways are fast there is nothing to gain.
  if (const auto free = EndOfFreeWay(target); free && (careful || free_by == FreeBy::kEstimate)) {
    const double gone = (*free - from).norm();
    PredictedCells rest = predicted;
    if (rest) rest = {(*predicted)[0] - gone, (*predicted)[1] - gone};
    const MotionReport outside = Onward([&] { return FastOnce(*free, kind, {}, FreeBy::kBelief); });
    return outside.contact ? outside : Fast(target, kind, rest, free_by);
  }
  if (record_.startled > 0) {
    for (const Eigen::Vector3d& via : WayOver(target)) {
      const MotionReport leg = Onward([&] { return FastOnce(via, kind, {}, free_by); });
      if (leg.contact) return leg;
    }
  }
  MotionReport report = Onward([&] { return FastOnce(target, kind, predicted, free_by); });
  for (int i = 0; doubts_ && report.contact && i < kMostFalse; ++i) {
    const Eigen::Vector3d place = report.end;
    const Eigen::Vector3d gone = place - from;
    Retreat(gone.norm() > kComeOff ? Eigen::Vector3d(place - kComeOff * gone.normalized()) : from);
    report = Onward([&] { return FastOnce(target, kind, {}, free_by); });
    if (report.contact && (report.end - place).norm() < kSamePlace) return report;
  }
  if (!report.contact) record_.careful = careful;
  return report;
}

MotionReport Mover::FastOnce(const Eigen::Vector3d& target, const std::string& kind, const PredictedCells& predicted,
                             FreeBy free_by) {
  CheckLimits();
  const Eigen::Vector3d way = target - position_;
  double speed_m_s = options_.transfer_speed_m_s;
  if (!way.isZero()) {
    if (!height_known_ && DirectionOf(way) == insertion_) speed_m_s = std::min(speed_m_s, kUnfelt_m_s);
    if (free_by != FreeBy::kInside && StaysOut(target)) {
      // Whatever was met is below.
    } else if (record_.startled > 0) {
      --record_.startled;
      speed_m_s = std::min(speed_m_s, SpeedOfCarefulWay(way.normalized()));
    } else if (record_.careful || free_by != FreeBy::kBelief) {
      speed_m_s = std::min(speed_m_s, SpeedInto(way.normalized(), free_by == FreeBy::kInside));
    }
  }
  const MotionResult result = robot_.LinearMove(frame_.ToWorld(target), speed_m_s, options_.contact_force_n);
  const MotionReport report = Finish(result, target, kind, predicted, true);
  const bool lost = steps_get_lost_ && !report.felt;  // on the way: Onward tells
  if (report.contact && !lost) ++record_.contacts;
  // Where nothing was to be, or harder than it may be: the next transfer may meet it again, with more way to gain
  // speed.
  const bool too_hard = record_.moves.back().peak_force_n > options_.force_budget_n;
  if (report.contact && (too_hard || (!predicted && !lost))) {
    record_.careful = true;
    record_.startled = kStartled;
  }
  return report;
}

MotionReport Mover::Onward(const std::function<MotionReport()>& motion) const {
  // One step more may be lost as well: a wall is what stops several motions at one place.
  constexpr int kAtOnePlace = 3;
  constexpr double kSamePlace = 0.1;
  MotionReport report = motion();
  for (int stopped = 1; steps_get_lost_ && report.contact && !report.felt && stopped < kAtOnePlace;) {
    const Eigen::Vector3d place = report.end;
    report = motion();
    stopped = (report.end - place).norm() < kSamePlace ? stopped + 1 : 1;
  }
  return report;
}

MotionReport Mover::Probe(Direction direction, double coordinate, const std::string& kind,
                          const PredictedCells& predicted, const MayMeet& may_meet) {
  return Onward([&] { return ProbeOnce(direction, coordinate, kind, predicted, may_meet); });
}

MotionReport Mover::ProbeOnce(Direction direction, double coordinate, const std::string& kind,
                              const PredictedCells& predicted, const MayMeet& may_meet) {
  CheckLimits();
  const Eigen::Vector3d from = Measure(robot_.ToolPose());
  position_ = from;
  Eigen::Vector3d target = from;
  target[AxisOf(direction)] = coordinate;
  const double cells = SignOf(direction) * (coordinate - from[AxisOf(direction)]);
  GuardedMotion motion;
  motion.direction = frame_.DirectionInWorld(direction);
  motion.distance_m = std::max(0.0, cells) * frame_.cell_m;
  const ContactResponse contact = ContactAlong(UnitVector(direction), may_meet.long_wall);
  double& excess = record_.force_excess[static_cast<std::size_t>(direction)];
  motion.speed_m_s = std::min(options_.probe_speed_m_s, SpeedOfProbe(motion.direction, contact, may_meet) / excess);
  motion.contact_force_n = options_.contact_force_n;
  const MotionReport report = Finish(robot_.Guarded(motion), target, kind, predicted, true);
  if (report.contact) ++record_.contacts;
  const double met_n = record_.moves.back().peak_force_n;
  if (met_n > options_.force_budget_n) {
    excess = std::max(excess, (met_n - contact.push_n) / (motion.speed_m_s * ForcePerSpeed(contact)));
  }
  return report;
}

double Mover::SpeedOfProbe(const Eigen::Vector3d& direction, const ContactResponse& face,
                           const MayMeet& may_meet) const {
  double speed_m_s = SpeedWithinBudget(face, options_.force_budget_n);
  if (!may_meet.edge_towards) return speed_m_s;
  const Eigen::Vector3d towards = frame_.world_T_estimate.linear() * *may_meet.edge_towards;
  speed_m_s = std::min(speed_m_s, SpeedOverEdge(face, robot_.Contact(towards), options_.force_budget_n));
  // The normal of an edge cut is between the faces; the tool comes along it with the cosine of its speed.
  const Eigen::Vector3d beyond = towards - towards.dot(direction) * direction;
  if (beyond.norm() < kAcross) return speed_m_s;  // along the way: that is the face
  const Eigen::Vector3d across = beyond.normalized();
  constexpr int kNormals = 5;
  for (int i = 1; i <= kNormals; ++i) {
    const double angle = 0.5 * std::numbers::pi * i / (kNormals + 1);
    const Eigen::Vector3d normal = std::cos(angle) * direction + std::sin(angle) * across;
    const double along_m_s = SpeedWithinBudget(robot_.Contact(normal), options_.force_budget_n);
    speed_m_s = std::min(speed_m_s, along_m_s / std::cos(angle));
  }
  return speed_m_s;
}

void Mover::Retreat(const Eigen::Vector3d& target) {
  CheckLimits();
  Finish(robot_.LinearMove(frame_.ToWorld(target), options_.transfer_speed_m_s, kUnwatched), target, "retreat", {},
         false);
  robot_.ZeroWrench();
}

double Mover::SpeedOfCarefulWay(const Eigen::Vector3d& way) const {
  double speed_m_s = SpeedInto(way);
  const Eigen::Vector3d in_world = frame_.world_T_estimate.linear() * way;
  const ContactResponse ahead = robot_.Contact(in_world);
  // Edges push where the contact is stiffest, along the insertion; across it they are soft.
  std::array<double, 3> stiffness_n_m{};
  for (const int axis : {0, 1, 2}) {
    stiffness_n_m[axis] = robot_.Contact(frame_.DirectionInWorld(MakeDirection(axis, 1))).Held().stiffness_n_m;
  }
  const auto stiffest = std::ranges::max_element(stiffness_n_m) - stiffness_n_m.begin();
  for (const Direction face : kDirections) {
    const double along = way.dot(UnitVector(face));
    if (along > kAcross) speed_m_s = std::min(speed_m_s, SpeedInto(UnitVector(face)) / along);
    if (AxisOf(face) != stiffest) continue;
    if (std::abs(along) < kAlong)
      speed_m_s = std::min(speed_m_s, SpeedOfProbe(in_world, ahead, {false, UnitVector(face)}));
  }
  return speed_m_s;
}

bool Mover::StaysOut(const Eigen::Vector3d& target) const {
  if (!outmost_) return false;
  const int axis = AxisOf(insertion_);
  const double out = -SignOf(insertion_);
  return std::min(out * position_[axis], out * target[axis]) >= out * *outmost_;
}

std::optional<Eigen::Vector3d> Mover::EndOfFreeWay(const Eigen::Vector3d& target) const {
  const Eigen::Vector3d way = target - position_;
  if (!outmost_ || way.isZero() || DirectionOf(way) != insertion_) return std::nullopt;
  const int axis = AxisOf(insertion_);
  const double out = -SignOf(insertion_);
  if (out * (position_[axis] - *outmost_) < kLeastFree || out * (*outmost_ - target[axis]) <= 0.0) {
    return std::nullopt;
  }
  return Eigen::Vector3d(position_ + way * ((*outmost_ - position_[axis]) / way[axis]));
}

std::vector<Eigen::Vector3d> Mover::WayOver(const Eigen::Vector3d& target) const {
  constexpr double kLonger = 1.3;  // than all of it that is still slow
  if (!outmost_) return {};
  const int axis = AxisOf(insertion_);
  const double out = -SignOf(insertion_);
  const double rise = std::max(0.0, out * (*outmost_ - position_[axis]));
  const double fall = std::max(0.0, out * (*outmost_ - target[axis]));
  if ((target - position_).norm() < kLonger * (rise + fall)) return {};
  std::vector<Eigen::Vector3d> way;
  for (const auto& [slow, end] : {std::pair(rise, position_), std::pair(fall, target)}) {
    if (slow <= 0.0) continue;
    way.push_back(end);
    way.back()[axis] = *outmost_;
  }
  return way;
}

double Mover::SpeedInto(const Eigen::Vector3d& direction, bool held) const {
  const auto nearest = DirectionOf(direction);
  const double excess = nearest ? record_.force_excess[static_cast<std::size_t>(*nearest)] : 1.0;
  return SpeedWithinBudget(ContactAlong(direction, held), options_.force_budget_n) / excess;
}

MotionReport Mover::Insert(const Eigen::Vector3d& target, std::optional<double> speed_m_s, bool rests) {
  CheckLimits();
  CompliantMotion motion;
  motion.world_T_tool = {frame_.ToWorld(target)};
  motion.speed_m_s = options_.insertion_speed_m_s;
  const Eigen::Vector3d way = target - position_;
  if (!way.isZero()) motion.speed_m_s = std::min(motion.speed_m_s, SpeedInto(way.normalized()));
  if (speed_m_s) motion.speed_m_s = record_.careful ? std::min(*speed_m_s, motion.speed_m_s) : *speed_m_s;
  if (!rests) motion.rest_time_s = 0.0;
  motion.force_limit_n = std::min(options_.insertion_force_limit_n, kPressShare * options_.force_budget_n);
  return Finish(robot_.Compliant(motion), target, "insert", {}, false);
}

MotionReport Mover::Press(const std::vector<Eigen::Vector3d>& way_points, double speed_m_s, const std::string& kind,
                          std::optional<double> stiffness_n_m) {
  CheckLimits();
  CompliantMotion motion;
  for (const Eigen::Vector3d& place : way_points) motion.world_T_tool.push_back(frame_.ToWorld(place));
  motion.speed_m_s = speed_m_s;
  if (stiffness_n_m) motion.stiffness_n_m.z() = *stiffness_n_m;
  motion.force_limit_n = std::min(options_.insertion_force_limit_n, kPressShare * options_.force_budget_n);
  const MotionReport report = Finish(robot_.Compliant(motion), way_points.back(), kind, {}, false);
  position_ = report.end;  // what it is pressed against, not the command, says where it is
  return report;
}

MotionReport Mover::Follow(const TwistMotion& motion) {
  CheckLimits();
  TwistMotion watched = motion;
  watched.contact_force_n = options_.contact_force_n;
  const MotionResult result = robot_.FollowTwist(watched);
  MotionReport report;
  report.end = Measure(result.world_T_tool);
  report.contact = result.contact || result.reason == StopReason::kContact;
  report.reason = result.reason;
  if (record_.moves.empty() || record_.moves.back().kind != "servo") {
    record_.moves.emplace_back();
    record_.moves.back().kind = "servo";
  }
  MoveRecord& move = record_.moves.back();
  const double travelled_m = (report.end - position_).norm() * frame_.cell_m;
  move.commanded_m += motion.linear_m_s.norm() * motion.duration_s;
  move.travelled_m += travelled_m;
  move.contact = report.contact;
  if (std::isfinite(result.peak_force_n)) move.peak_force_n = std::max(move.peak_force_n, result.peak_force_n);
  const double now_s = robot_.Time();
  move.duration_s += now_s - last_motion_end_s_;
  last_motion_end_s_ = now_s;
  record_.peak_force_n = std::max(record_.peak_force_n, move.peak_force_n);
  record_.path_length_m += travelled_m;
  position_ = report.end;
  if (report.contact) ++record_.contacts;
  if (result.reason == StopReason::kAborted || result.reason == StopReason::kUnplanned) {
    throw ExecutionFailure(fmt::format("robot: servo motion {}{}{}", ToString(result.reason),
                                       result.detail.empty() ? "" : ": ", result.detail));
  }
  return report;
}

}  // namespace feeler::execution
