#include "feeler/execution/lattice/localizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "feeler/execution/contact/continuous_travel.h"
#include "feeler/execution/contact/fall_in.h"
#include "feeler/execution/contact/policy_call.h"

namespace feeler::execution {
namespace {

/// Positions nearer than this, in cells, count as the same: less than any overtravel, more than a tracking error.
constexpr double kSamePlace = 0.1;
/// A motion of its own costs so much for beginning and ending: a fast one must save more.
constexpr double kMotion_s = 0.05;

/// A wall that is met along more of the tool than this holds it: it cannot turn away. Up to here simulated contacts
/// show no more than the mass of a tool that is met at its tip.
constexpr double kHeld_m = 0.005;

/// After a contact the tool has come off by no more than this, cells.
constexpr double kCameOff = 1.5;
/// A chamfer is read up to this much deeper than the face around it, cells.
constexpr double kRim = 0.6;

/// A touch from coordinate `from` along the direction to where the motion ended, at the place across where it ended.
Touch MakeTouch(Direction direction, double from, const MotionReport& report) {
  Touch touch;
  touch.direction = direction;
  touch.contact = report.contact;
  touch.start = report.end;
  touch.start[AxisOf(direction)] = from;
  touch.travelled = SignOf(direction) * (report.end[AxisOf(direction)] - from);
  return touch;
}

}  // namespace

Localizer::Localizer(const Task& task, const planner::Problem& problem, policies::Policy& policy, Mover& mover,
                     ExecutionRecord& record)
    : task_(task),
      problem_(problem),
      policy_(policy),
      mover_(mover),
      record_(record),
      robot_(problem.start),
      doubt_(policy.doubt()) {
  for (const planner::Hypothesis& hypothesis : problem.hypotheses) {
    tracked_.push_back({hypothesis, Eigen::Vector3d::Zero()});
  }
  if (doubt_ != nullptr) noise_.emplace(doubt_->noise);
}

policies::Belief Localizer::View() const {
  policies::Belief belief;
  belief.robot = robot_;
  if (!policy_.reads_hypotheses()) return belief;
  for (const TrackedHypothesis& t : tracked_) belief.hypotheses.push_back(t.hypothesis);
  return belief;
}

policies::Decision Localizer::Ask() {
  const policies::Belief belief = View();
  return CallPolicy(record_, [&] { return policy_.Next(belief); });
}

bool Localizer::Tell(const Outcome& outcome) {
  return CallPolicy(record_, [&] { return policy_.Observe(outcome); });
}

policies::Decision Localizer::Run() {
  mover_.KnowHeight(face_felt_);
  const double before = ThreadCpuSeconds();
  policy_.Begin(problem_);
  record_.policy_cpu_s += ThreadCpuSeconds() - before;
  if (record_.attempts++ == 0) record_.hypotheses = static_cast<int>(problem_.hypotheses.size());
  while (true) {
    policies::Decision decision = Ask();
    if (const auto* give_up = std::get_if<policies::GiveUp>(&decision)) {
      throw LostTrack("policy gave up: " + give_up->reason);
    }
    if (!std::holds_alternative<GuardedMove>(decision)) {
      SettleDoubt();
      ComeOut();
      return decision;
    }
    // Readings are finer than outcomes: they may tell before the policy does.
    if (tracked_.size() == 1) {
      SettleDoubt();
      ComeOut();
      return policies::Insert{};
    }
    const GuardedMove move = std::get<GuardedMove>(decision);
    if (move.cells < 1 || move.cells > 100000) {
      throw ExecutionFailure(fmt::format("policy: a guarded move of {} cells", move.cells));
    }
    const Cell end = robot_ + move.cells * UnitCell(move.direction);
    if (!problem_.workspace.Contains(end)) throw ExecutionFailure("policy: a guarded move out of the workspace");
    if (++record_.policy_moves > mover_.options().motion_limit) {
      throw ExecutionFailure(fmt::format("limit: {} moves of the policy without a verdict", record_.policy_moves - 1));
    }
    Carry(move);
    if (found_inside_) return policies::Insert{};
  }
}

Localizer::Prediction Localizer::Predict(const GuardedMove& move) const {
  Prediction prediction;
  prediction.nearest = std::numeric_limits<double>::infinity();
  for (const TrackedHypothesis& t : tracked_) {
    const double travel = PredictTravel(*problem_.map, t, Station(), move.direction);
    prediction.nearest = std::min(prediction.nearest, travel);
    prediction.farthest = std::max(prediction.farthest, travel);
    prediction.sure_contact =
        prediction.sure_contact &&
        problem_.map->Predict(robot_ - t.hypothesis.offset, move, t.hypothesis.orientation).contact;
  }
  return prediction;
}

void Localizer::Carry(const GuardedMove& move) {
  // A move ends at a lattice point whatever place it began from.
  const int axis = AxisOf(move.direction);
  const double behind = kept_offset_[axis];
  if (pending_ && *pending_ != move.direction) Flush();
  if (found_inside_) return;
  kept_offset_[axis] = 0.0;
  const Prediction prediction = Predict(move);
  if (prediction.nearest >= move.cells + mover_.options().free_margin_cells) {
    Postpone(move);
    return;
  }
  // The station across the motion must hold: come back from an overtravel along another axis first.
  if (!pending_) {
    Eigen::Vector3d station = Station();
    station[axis] += behind;
    Eigen::Vector3d off = mover_.position() - station;
    off[axis] = 0.0;
    if (off.norm() > kSamePlace) {
      const MotionReport report = mover_.Fast(station, "transfer");
      if (report.contact) mover_.Retreat(station);
    }
  }
  Feel(move, prediction);
}

void Localizer::Postpone(const GuardedMove& move) {
  Touch imagined;
  imagined.start = Station();
  imagined.direction = move.direction;
  imagined.travelled = move.cells;
  if (!pending_) {
    // The motion starts at the station: an overtravel along another axis is taken back first.
    Eigen::Vector3d off = mover_.position() - Station();
    off[AxisOf(move.direction)] = 0.0;
    if (lifted_) off[AxisOf(task_.insertion)] = 0.0;  // comes down on its way
    if (off.norm() > kSamePlace) {
      Eigen::Vector3d station = Station();
      station[AxisOf(move.direction)] = mover_.position()[AxisOf(move.direction)];
      const MotionReport report = mover_.Fast(station, "transfer");
      if (report.contact) mover_.Retreat(station);
    }
    pending_ = move.direction;
  }
  if (!TakeOver(move, imagined, mover_.options().matching.tolerance_cells)) FailOffTree(imagined);
}

void Localizer::Flush() {
  const Direction direction = *pending_;
  const int axis = AxisOf(direction);
  while (true) {
    const double from = mover_.position()[axis];
    const Eigen::Vector3d target = Station();
    const double cells = SignOf(direction) * (target[axis] - from);
    const MotionReport report = FastFree(target, std::array<double, 2>{cells, cells});
    const Touch touch = MakeTouch(direction, from, report);
    evidence_.push_back(touch);
    if (!report.contact) break;
    // Come off, but not farther back than the motion came; half as far where the opposite wall may be as near.
    const double came = std::max(0.0, touch.travelled);
    mover_.Retreat(report.end - std::min(0.5, went_in_ ? 0.5 * came : came) * UnitVector(direction));
    if (FoundInside()) return;
    ShiftOffEdge(touch);
  }
  pending_.reset();
  lifted_ = false;
}

void Localizer::Feel(const GuardedMove& move, const Prediction& prediction) {
  Prediction now = prediction;
  const double tolerance = mover_.options().matching.tolerance_cells;
  lifted_ = false;
  while (true) {
    const Eigen::Vector3d begun = mover_.position();
    const Touch touch = ProbeAlong(move, now);
    went_in_ = move.direction == task_.insertion;
    stopped_inward_ = went_in_ && touch.contact;
    evidence_.push_back(touch);
    pending_.reset();
    if (TakeShort(move, touch)) {
      mover_.Retreat(Station());
      return;
    }
    if (TakeOver(move, touch, tolerance)) {
      if (touch.contact) RetreatFromContact(move.direction);
      return;
    }
    const bool over_mouth = MayHaveFallenIn(task_, problem_, mover_.position());
    if (touch.contact) mover_.Retreat(touch.end() - std::min(0.5, touch.travelled) * UnitVector(move.direction));
    if (FoundInside()) return;
    // Not inside, but on the rim of the opening, perhaps: its chamfer is met deeper than the closed face.
    if (over_mouth && touch.contact && move.direction == task_.insertion && TakeOver(move, touch, tolerance + kRim)) {
      mover_.Retreat(Station());
      return;
    }
    if (TakeForFalse(move, touch)) {
      mover_.Retreat(Station());
      return;
    }
    mover_.Retreat(begun);  // to where it began, for the other side of the edge
    ShiftOffEdge(touch);
    now = Predict(move);
  }
}

Touch Localizer::ProbeAlong(const GuardedMove& move, const Prediction& prediction) {
  const ExecutorOptions& options = mover_.options();
  const int axis = AxisOf(move.direction);
  const int sign = SignOf(move.direction);
  const Eigen::Vector3d station = Station();
  const double from = mover_.position()[axis];
  const double overtravel = prediction.sure_contact ? options.sure_overtravel_cells : options.overtravel_cells;
  double reach = move.cells + overtravel;
  if (prediction.sure_contact && move.direction == task_.insertion) {
    // Where an opening goes through, nothing else would stop a tool that fell in from going deeper than it is found at.
    reach = std::min(reach, prediction.farthest + task_.insertion_depth_m / task_.cell_m);
  }
  const double end = station[axis] + sign * reach;
  const double behind = sign * (station[axis] - from);  // positive: a pending motion lies before the move
  const PredictedCells predicted = std::array<double, 2>{prediction.nearest + behind, prediction.farthest + behind};

  const double fast = std::min<double>(move.cells, prediction.nearest - FastMargin(move.direction));
  if (FastIsWorth(move.direction, fast + behind)) {
    Eigen::Vector3d target = station;
    target[axis] += sign * fast;
    const MotionReport report = FastFree(target, predicted);
    if (report.contact) {
      // A contact at speed is read late: come off and feel again slowly.
      mover_.Retreat(report.end - UnitVector(move.direction));
    }
  }
  const double gone = sign * (mover_.position()[axis] - from);
  const PredictedCells left = std::array<double, 2>{(*predicted)[0] - gone, (*predicted)[1] - gone};
  const MayMeet may_meet = WhatMayBeMet(move.direction, move.cells + overtravel);
  MotionReport report = mover_.ProbeOnce(move.direction, end, "probe", left, may_meet);
  if (doubt_ != nullptr && doubt_->steps_get_lost()) report.contact = report.felt;
  return MakeTouch(move.direction, from, report);
}

double Localizer::FastMargin(Direction direction) const {
  return direction == task_.insertion && faces_known_ ? mover_.FaceMargin() : mover_.options().fast_margin_cells;
}

bool Localizer::FastIsWorth(Direction direction, double cells) const {
  const ExecutorOptions& options = mover_.options();
  const double probe_m_s = std::min(options.probe_speed_m_s, mover_.SpeedInto(UnitVector(direction)));
  return cells * mover_.frame().cell_m * (1.0 / probe_m_s - 1.0 / options.transfer_speed_m_s) > kMotion_s;
}

MayMeet Localizer::WhatMayBeMet(Direction direction, double cells) const {
  MayMeet met;
  if (AxisOf(direction) == AxisOf(task_.insertion)) return met;  // a face: the robot counts with that
  // Where nothing was felt along the insertion yet, the rim of a target may stand anywhere in the cell of its edge.
  const bool height_felt = std::any_of(evidence_.begin(), evidence_.end(), [&](const Touch& touch) {
    return touch.contact && touch.direction == task_.insertion;
  });
  const Eigen::Vector3d back = -UnitVector(task_.insertion);
  const Eigen::Vector3d station = Station();
  for (const TrackedHypothesis& t : tracked_) {
    const double travel = PredictTravel(*problem_.map, t, station, direction);
    if (travel > cells) continue;
    const auto same_higher = [&](double by_cells) {
      return PredictTravel(*problem_.map, t, station + by_cells * back, direction) <= travel + kSamePlace;
    };
    if (same_higher(mover_.Cells(kHeld_m))) met.long_wall = true;
    if (!height_felt && !same_higher(1.0)) met.edge_towards = back;
  }
  return met;
}

bool Localizer::TakeOver(const GuardedMove& move, const Touch& touch, double tolerance_cells) {
  const MatchOptions matching{tolerance_cells};
  const std::vector<OutcomeMatch> matches = MatchOutcomes(*problem_.map, tracked_, robot_, move, touch, matching);
  for (const OutcomeMatch& match : matches) {
    if (Accept(move, touch, match.outcome, matching, match.best)) return true;
  }
  if (!matches.empty() && doubt_ == nullptr)
    throw LostTrack("policy: no branch for any outcome that explains the reading");
  return false;
}

bool Localizer::Accept(const GuardedMove& move, const Touch& touch, const Outcome& outcome,
                       const MatchOptions& matching, std::optional<std::size_t> best) {
  const int axis = AxisOf(touch.direction);
  const int outcomes = CountOutcomes(move);
  if (doubt_ != nullptr) {
    std::vector<TrackedHypothesis> weighed = tracked_;
    if (!Weigh(*problem_.map, robot_, move, touch, outcome, matching, *noise_, weighed) || !Tell(outcome)) return false;
    tracked_ = std::move(weighed);
    // The lattice is tied to the hypothesis that is believed now.
    if (touch.contact) anchor_[axis] = tracked_[Likeliest(tracked_)].anchor[axis];
  } else {
    if (!Tell(outcome)) return false;
    if (touch.contact) {
      const TrackedHypothesis& explains = tracked_[best.value()];
      const double travel = PredictTravel(*problem_.map, explains, touch.start, touch.direction);
      if (touch.direction == task_.insertion) {
        faces_known_ = face_felt_ && std::abs(touch.travelled - travel) < kFacesAgree;
        face_felt_ = true;
        mover_.KnowHeight(true);
      }
      anchor_[axis] = explains.anchor[axis] + SignOf(touch.direction) * (touch.travelled - travel);
    }
    Settle(*problem_.map, robot_, move, touch, outcome, matching, tracked_);
  }
  LogDecision(move, outcome, outcomes);
  robot_ += outcome.cells * UnitCell(move.direction);
  return true;
}

bool Localizer::TakeShort(const GuardedMove& move, const Touch& touch) {
  if (doubt_ == nullptr || !doubt_->steps_get_lost() || touch.contact) return false;
  constexpr double kHalfCell = 0.5;
  const int axis = AxisOf(touch.direction);
  const double from_station = SignOf(touch.direction) * (touch.end()[axis] - Station()[axis]);
  Outcome read = OutcomeAsRead(move, from_station, false);
  // Where it stands at a wall, that one's cell: walls are anywhere between two lattice points before they are felt.
  double nearest = kHalfCell;
  for (const TrackedHypothesis& t : tracked_) {
    const double off = std::abs(touch.travelled - PredictTravel(*problem_.map, t, touch.start, touch.direction));
    if (off >= nearest) continue;
    nearest = off;
    read.cells = problem_.map->Predict(robot_ - t.hypothesis.offset, move, t.hypothesis.orientation).cells;
  }
  return read.cells < move.cells && Accept(move, touch, read, mover_.options().matching, std::nullopt);
}

bool Localizer::TakeForFalse(const GuardedMove& move, const Touch& touch) {
  if (doubt_ == nullptr || !touch.contact || !(doubt_->noise.false_stop > 0.0)) return false;
  constexpr double kAgain = 0.3;
  const bool again = false_contact_ && false_contact_->direction == touch.direction &&
                     (false_contact_->end() - touch.end()).norm() < kAgain;
  false_contact_ = touch;
  if (again) return false;
  const int axis = AxisOf(touch.direction);
  const double from_station = SignOf(touch.direction) * (touch.end()[axis] - Station()[axis]);
  return Accept(move, touch, OutcomeAsRead(move, from_station, true), mover_.options().matching, std::nullopt);
}

void Localizer::SettleDoubt() {
  if (doubt_ == nullptr) return;
  KeepLikely(doubt_->confidence, tracked_);
  const TrackedHypothesis& believed = tracked_[Likeliest(tracked_)];
  std::erase_if(evidence_, [&](const Touch& touch) {
    return touch.contact && !touch.is_oblique() &&
           Mismatch(*problem_.map, believed, touch) > mover_.options().matching.tolerance_cells;
  });
}

int Localizer::CountOutcomes(const GuardedMove& move) const {
  std::set<std::pair<int, bool>> outcomes;
  for (const TrackedHypothesis& t : tracked_) {
    const Outcome outcome = problem_.map->Predict(robot_ - t.hypothesis.offset, move, t.hypothesis.orientation);
    outcomes.emplace(outcome.cells, outcome.contact);
  }
  return static_cast<int>(outcomes.size());
}

void Localizer::LogDecision(const GuardedMove& move, const Outcome& outcome, int outcomes) {
  DecisionRecord decision;
  decision.attempt = record_.attempts - 1;
  decision.motions = static_cast<int>(record_.moves.size());
  decision.direction = ToString(move.direction);
  decision.cells = move.cells;
  decision.travelled_cells = outcome.cells;
  decision.contact = outcome.contact;
  decision.outcomes = outcomes;
  // Those left stand in the order of the problem.
  std::size_t index = 0;
  for (const TrackedHypothesis& t : tracked_) {
    while (problem_.hypotheses.at(index).offset != t.hypothesis.offset ||
           problem_.hypotheses[index].orientation != t.hypothesis.orientation) {
      ++index;
    }
    decision.left.push_back(static_cast<int>(index++));
  }
  record_.decisions.push_back(std::move(decision));
}

MotionReport Localizer::FastFree(const Eigen::Vector3d& target, const PredictedCells& predicted) {
  const Eigen::Vector3d begun = mover_.position();
  Eigen::Vector3d across = target - begun;
  const double inward = across[AxisOf(task_.insertion)] * SignOf(task_.insertion);
  across[AxisOf(task_.insertion)] = 0.0;
  if (across.norm() < kSamePlace) {
    stopped_inward_ = stopped_inward_ && !(inward > 0.0);
    went_in_ = went_in_ || inward > 0.0;
    return mover_.Fast(target, "transfer", predicted);
  }
  if (went_in_ && MayHaveFallenIn(task_, problem_, begun)) {
    const double length = (target - begun).norm();
    const double slow = std::min(length, FarthestWallInside(task_, mover_));
    const Eigen::Vector3d first = begun + slow / length * (target - begun);
    // What has stopped it was the bottom, or it stands no deeper than in the lead-in, where it can turn away.
    const double bottom = mover_.Cells(task_.insertion_depth_m - task_.tolerance.vertical_m) - kCameOff;
    const bool held = !stopped_inward_ || MayHaveFallenIn(task_, problem_, begun, bottom);
    const FreeBy free_by = held ? FreeBy::kInside : FreeBy::kEstimate;
    const MotionReport report = mover_.Fast(first, "transfer", std::array<double, 2>{slow, slow}, free_by);
    if (report.contact || slow == length) return report;
  }
  went_in_ = false;
  return mover_.Fast(target, "transfer", predicted);
}

bool Localizer::FoundInside() {
  if (!MayHaveFallenIn(task_, problem_, mover_.position())) return false;
  found_inside_ = LocateFromInside(task_, problem_, mover_);
  return found_inside_.has_value();
}

void Localizer::ComeOut() {
  if (!went_in_ || stopped_inward_) return;
  if (const auto depth = DeepestInside(task_, problem_, mover_.position())) {
    mover_.Retreat(mover_.position() - (*depth - kAtMouth) * UnitVector(task_.insertion));
  }
}

void Localizer::ShiftOffEdge(const Touch& touch) {
  const std::optional<Eigen::Vector3d> shift = GrazeShift(*problem_.map, tracked_, touch, mover_.options().matching);
  if (!shift || record_.grazes >= mover_.options().graze_attempts) FailOffTree(touch);
  ++record_.grazes;
  // The tool may stand right beside the wall of the target that it has passed.
  const Eigen::Vector3d begun = mover_.position();
  const Direction side = DirectionOf(*shift).value();
  const double from = begun[AxisOf(side)];
  const MotionReport report = mover_.Probe(side, from + (*shift)[AxisOf(side)], "probe", {});
  anchor_ += *shift;
  if (report.contact) {
    evidence_.push_back(MakeTouch(side, from, report));
    mover_.Retreat(begun);
    kept_offset_ -= *shift;
  }
  for (TrackedHypothesis& t : tracked_) t.anchor += *shift;
}

void Localizer::RetreatFromContact(Direction direction) {
  const int axis = AxisOf(direction);
  const double room = std::max(mover_.Cells(mover_.options().retreat_m), 0.0);
  const Eigen::Vector3d station = Station();
  const double wall = mover_.position()[axis];
  const double to_wall = SignOf(direction) * (wall - station[axis]);
  // Not nearer than that, and no farther off a face than needed: what touches it next goes that way slowly.
  if (to_wall < room || (direction == task_.insertion && faces_known_)) {
    kept_offset_[axis] = SignOf(direction) * (to_wall - std::max(room, std::min(to_wall, mover_.FaceMargin())));
  }
  // What it has met may be the lead-in of an opening, and the face beside it higher.
  lifted_ = direction == task_.insertion && !faces_known_ && MayHaveFallenIn(task_, problem_, mover_.position());
  mover_.Retreat(lifted_ ? Eigen::Vector3d(Station() - kRim * UnitVector(direction)) : Station());
}

void Localizer::FailOffTree(const Touch& touch) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const TrackedHypothesis& t : tracked_) {
    const double travel = PredictTravel(*problem_.map, t, touch.start, touch.direction);
    if (std::abs(travel - touch.travelled) < std::abs(nearest - touch.travelled)) nearest = travel;
  }
  const double cell_mm = 1e3 * mover_.frame().cell_m;
  const std::string expected = nearest < 1e6 ? fmt::format("nearest prediction {:.2f} mm", nearest * cell_mm)
                                             : std::string("no contact predicted");
  throw LostTrack(fmt::format("off the policy tree: {} after {:.2f} mm of {}, {} ({} hypotheses left)",
                              touch.contact ? "contact" : "no contact", touch.travelled * cell_mm,
                              ToString(touch.direction), expected, tracked_.size()));
}

}  // namespace feeler::execution
