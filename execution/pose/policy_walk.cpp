#include "feeler/execution/pose/policy_walk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <variant>

#include "feeler/execution/contact/policy_call.h"

namespace feeler::execution {
namespace {

/// Between lattice orientations a wall may lie this much nearer than under any of them, cells.
constexpr double kFreeMargin = 1.5;
/// Readings between lattice orientations may have left the wrong hypotheses: walls were met by up to so many cells
/// nearer than all that are left predict.
constexpr double kSure = 5.0;
/// A reading worse than this counts as no worse: no single one rules a hypothesis out.
constexpr double kMisfitCap = 3.0;
/// Tool and lattice may differ by this, cells.
constexpr double kFarOff = 1.6;
constexpr double kShortestFast = 0.75;
/// A wall that was met within so many cells may reach to here, and is passed by so much before the tool goes fast.
constexpr double kBeside = 6.0;
constexpr double kPast = 1.0;

}  // namespace

FeltMotion FeltFrom(const LatticeFrame& frame, Direction direction, const Eigen::Vector3d& from,
                    const MotionReport& report, double sigma_m) {
  const int axis = AxisOf(direction);
  Eigen::Vector3d begin = report.end;
  begin[axis] = from[axis];
  FeltMotion felt;
  felt.motion.from_m = (begin - frame.center) * frame.cell_m;
  felt.motion.direction = direction;
  felt.travelled_m = SignOf(direction) * (report.end[axis] - from[axis]) * frame.cell_m;
  felt.contact = report.contact;
  felt.sigma_m = sigma_m;
  return felt;
}

PolicyWalk::PolicyWalk(const planner::Problem& problem, policies::Policy& policy, Mover& mover, ExecutionRecord& record)
    : problem_(problem), policy_(policy), mover_(mover), record_(record), robot_(problem.start) {
  int index = 0;
  for (const planner::Hypothesis& hypothesis : problem.hypotheses) tracked_.push_back({hypothesis, index++, 0.0});
}

double PolicyWalk::Predict(const Tracked& tracked, const GuardedMove& move) const {
  return double{
      problem_.map->Travel(robot_ - tracked.hypothesis.offset, move.direction, tracked.hypothesis.orientation)};
}

policies::Insert PolicyWalk::Run(std::vector<FeltMotion>& felt, const std::function<bool()>& enough) {
  const double before = ThreadCpuSeconds();
  policy_.Begin(problem_);
  record_.policy_cpu_s += ThreadCpuSeconds() - before;
  if (record_.attempts++ == 0) record_.hypotheses = static_cast<int>(problem_.hypotheses.size());
  while (true) {
    policies::Belief belief;
    belief.robot = robot_;
    if (policy_.reads_hypotheses()) {
      for (const Tracked& t : tracked_) belief.hypotheses.push_back(t.hypothesis);
    }
    const policies::Decision decision = CallPolicy(record_, [&] { return policy_.Next(belief); });
    const auto* move = std::get_if<GuardedMove>(&decision);
    if (move == nullptr || tracked_.size() == 1) {
      const auto* insert = std::get_if<policies::Insert>(&decision);
      // One that gives up has no plan; touches chosen on the way may still tell.
      if (move == nullptr && insert == nullptr && !std::holds_alternative<policies::GiveUp>(decision)) {
        throw ExecutionFailure("policy: searches in a way that needs a known orientation of the target");
      }
      Flush(felt);
      return insert != nullptr ? *insert : policies::Insert{};
    }
    if (move->cells < 1 || !problem_.workspace.Contains(robot_ + move->cells * UnitCell(move->direction))) {
      throw ExecutionFailure("policy: a guarded move out of the workspace");
    }
    if (++record_.policy_moves > mover_.options().motion_limit) throw ExecutionFailure("limit: moves of the policy");

    double nearest = std::numeric_limits<double>::infinity();
    double farthest = 0.0;
    for (const Tracked& t : tracked_) {
      const double travel = Predict(t, *move);
      nearest = std::min(nearest, travel);
      farthest = std::max(farthest, travel);
    }
    if (nearest >= move->cells + kFreeMargin) {
      if (pending_ && pending_direction_ != move->direction && !Flush(felt)) return {};
      pending_ = true;
      pending_direction_ = move->direction;
      pending_clear_ = nearest - move->cells;
      if (!TakeOver(*move, {static_cast<double>(move->cells), false})) return {};
      continue;
    }
    if (pending_ && pending_direction_ != move->direction && !Flush(felt)) return {};
    const Reading reading = Feel(*move, nearest, farthest, felt);
    if (!TakeOver(*move, reading)) return {};
    // Back to the lattice point of the new cell, as far as the wall allows.
    const int axis = AxisOf(move->direction);
    const int sign = SignOf(move->direction);
    const double room = std::max(mover_.Cells(mover_.options().retreat_m), 0.25);
    Eigen::Vector3d place = mover_.position();
    place[axis] = Station()[axis];
    if (reading.contact) {
      const double wall = mover_.position()[axis];
      if (sign * (wall - place[axis]) < room) place[axis] = wall - sign * room;
    }
    if (reading.contact || std::abs(place[axis] - mover_.position()[axis]) > 0.3) mover_.Retreat(place);
    if ((mover_.position() - Station()).cwiseAbs().maxCoeff() > kFarOff) return {};
    if (reading.contact && enough()) return {};
  }
}

bool PolicyWalk::Flush(std::vector<FeltMotion>& felt) {
  if (!pending_) return true;
  pending_ = false;
  const int axis = AxisOf(pending_direction_);
  const Eigen::Vector3d from = mover_.position();
  Eigen::Vector3d target = from;
  target[axis] = Station()[axis];
  if (SignOf(pending_direction_) * (target[axis] - from[axis]) < 0.05) return true;
  const MotionReport report = FastPast(target, pending_direction_, pending_clear_);
  felt.push_back(FeltFrom(mover_.frame(), pending_direction_, from, report, kFastSigma_m));
  if (!report.contact) return true;
  mover_.Retreat(report.end - std::min(1.0, (report.end - from).norm()) * UnitVector(pending_direction_));
  return false;
}

MotionReport PolicyWalk::FastPast(const Eigen::Vector3d& target, Direction direction, double clear) {
  const std::optional<Eigen::Vector3d>& met = met_[static_cast<std::size_t>(IndexOf(direction))];
  const int axis = AxisOf(direction);
  const int sign = SignOf(direction);
  const Eigen::Vector3d begun = mover_.position();
  if (met && sign * ((*met)[axis] - begun[axis]) > 0.0 && sign * (target[axis] - (*met)[axis]) > 0.0) {
    Eigen::Vector3d beside = *met - begun;
    beside[axis] = 0.0;
    Eigen::Vector3d past = target;
    past[axis] = sign * std::min(sign * target[axis], sign * (*met)[axis] + kPast);
    if (beside.norm() <= kBeside) {
      const MotionReport report = mover_.Fast(past, "transfer", {}, FreeBy::kEstimate);
      if (report.contact || past == target) return report;
    }
  }
  Eigen::Vector3d sure = target;
  sure[axis] -= sign * std::max(0.0, kSure - clear);
  if (sure == target) return mover_.Fast(target, "transfer");
  if (sign * (sure[axis] - mover_.position()[axis]) >= kShortestFast) {
    const MotionReport report = mover_.Fast(sure, "transfer");
    if (report.contact) return report;
  }
  return mover_.Fast(target, "transfer", {}, FreeBy::kEstimate);
}

PolicyWalk::Reading PolicyWalk::Feel(const GuardedMove& move, double nearest, double farthest,
                                     std::vector<FeltMotion>& felt) {
  const ExecutorOptions& options = mover_.options();
  const int axis = AxisOf(move.direction);
  const int sign = SignOf(move.direction);
  pending_ = false;
  const double station = Station()[axis];
  const Eigen::Vector3d begun = mover_.position();
  const double behind = sign * (station - begun[axis]);
  const double end = station + sign * (move.cells + options.overtravel_cells);
  const double fast = std::min<double>(move.cells, nearest) - kFreeMargin;
  if (fast + behind >= kShortestFast) {
    Eigen::Vector3d target = begun;
    target[axis] = station + sign * fast;
    const MotionReport report = FastPast(target, move.direction, nearest - fast);
    // A contact at speed is read late: come off and feel again slowly.
    if (report.contact) mover_.Retreat(report.end - UnitVector(move.direction));
  }
  const Eigen::Vector3d from = mover_.position();
  const double gone = sign * (from[axis] - station);
  const MotionReport report =
      mover_.Probe(move.direction, end, "probe", std::array<double, 2>{nearest - gone, farthest - gone});
  felt.push_back(FeltFrom(mover_.frame(), move.direction, begun, report, kProbeSigma_m));
  if (report.contact) met_[static_cast<std::size_t>(IndexOf(move.direction))] = report.end;
  return {sign * (report.end[axis] - station), report.contact};
}

bool PolicyWalk::TakeOver(const GuardedMove& move, const Reading& reading) {
  // Outcomes by the misfit of the hypothesis that explains all readings best under it.
  struct Branch {
    Outcome outcome;
    double misfit = std::numeric_limits<double>::infinity();
  };
  std::map<std::pair<int, bool>, Branch> branches;
  for (Tracked& t : tracked_) {
    const Outcome outcome = problem_.map->Predict(robot_ - t.hypothesis.offset, move, t.hypothesis.orientation);
    const double travel = Predict(t, move);
    const double off =
        reading.contact ? std::abs(travel - reading.travelled) : std::max(0.0, reading.travelled - travel);
    const double capped = std::min(off, kMisfitCap);
    t.misfit += capped * capped;
    Branch& branch = branches[{outcome.cells, outcome.contact}];
    branch.outcome = outcome;
    branch.misfit = std::min(branch.misfit, t.misfit);
  }
  std::vector<Branch> ranked;
  for (const auto& entry : branches) ranked.push_back(entry.second);
  std::stable_sort(ranked.begin(), ranked.end(), [](const Branch& a, const Branch& b) { return a.misfit < b.misfit; });
  for (const Branch& branch : ranked) {
    if (!CallPolicy(record_, [&] { return policy_.Observe(branch.outcome); })) continue;
    std::vector<Tracked> left;
    for (const Tracked& t : tracked_) {
      if (problem_.map->Predict(robot_ - t.hypothesis.offset, move, t.hypothesis.orientation) == branch.outcome) {
        left.push_back(t);
      }
    }
    tracked_ = std::move(left);
    DecisionRecord decision;
    decision.attempt = record_.attempts - 1;
    decision.motions = static_cast<int>(record_.moves.size());
    decision.direction = ToString(move.direction);
    decision.cells = move.cells;
    decision.travelled_cells = branch.outcome.cells;
    decision.contact = branch.outcome.contact;
    decision.outcomes = static_cast<int>(ranked.size());
    for (const Tracked& t : tracked_) decision.left.push_back(t.index);
    record_.decisions.push_back(std::move(decision));
    robot_ += branch.outcome.cells * UnitCell(move.direction);
    return true;
  }
  return false;
}

}  // namespace feeler::execution
