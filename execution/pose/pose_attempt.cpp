#include "feeler/execution/pose/pose_attempt.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "feeler/core/orientation_lattice.h"
#include "feeler/core/random.h"
#include "feeler/execution/contact/continuous_travel.h"
#include "feeler/execution/contact/insertion.h"
#include "feeler/execution/pose/policy_walk.h"
#include "feeler/execution/pose/pose_fit.h"
#include "feeler/execution/pose/touch_choice.h"

namespace feeler::execution {
namespace {

constexpr int kStarts = 8;        ///< of a fit
constexpr int kMostTouches = 24;  ///< beyond the policy's, over all insertions tried
constexpr int kLeastTouches = 2;  ///< beyond the policy's, before an insertion
constexpr int kInsertions = 4;
constexpr double kAgree_m = 4e-4;     ///< a touch confirms a fit that foretold it this well
constexpr double kWorst_m = 8e-4;     ///< residual of an explained contact
constexpr double kKnown_m = 3e-4;     ///< standard deviation of the position across the insertion
constexpr double kKnown_rad = 0.008;  ///< of the tilt
/// Other fits whose cost is up to this above the best one's are possible still.
constexpr double kRivals = 40.0;
constexpr int kLeastContacts = 4;  ///< before a walk of the policy can end early
constexpr double kRoughly = 3.0;
constexpr int kSamples = 12;  ///< of the poses that a fit leaves
constexpr double kStandoff_m = 0.012;
constexpr double kNearStandoff_m = 0.003;
constexpr double kDrawOut_m_s = 0.05;
constexpr double kDrawnOut = 1.0;  ///< cells short of where a tool was drawn to

struct Knowledge {
  std::vector<PoseFit> fits;  ///< best first
  std::vector<PoseCandidate> candidates;
  double lateral_m = 0.0;  ///< standard deviation over the candidates
  double tilt_rad = 0.0;
};

class PoseAttempt {
 public:
  PoseAttempt(const Episode& episode, const planner::Problem& problem, const Pose& world_T_estimate,
              policies::Policy& policy, planner::TravelModel& model)
      : episode_(episode),
        task_(episode.task),
        problem_(problem),
        policy_(policy),
        model_(model),
        frame_(FrameOf(episode.task, problem, world_T_estimate)),
        mover_(episode.robot, frame_, episode.task.insertion, episode.options, episode.record, episode.started_s),
        along_(AxisOf(episode.task.insertion)),
        out_(-SignOf(episode.task.insertion)) {
    SetBox();
    SetSpace();
  }

  std::string Run() {
    const Eigen::Vector3d start = problem_.start.cast<double>() + problem_.map->phase();
    const double off = (mover_.position() - start).cwiseAbs().maxCoeff();
    if (off > 0.5) {
      throw ExecutionFailure(
          fmt::format("start: the tool is {:.2f} mm from the start pose", 1e3 * off * frame_.cell_m));
    }
    mover_.ZeroWrench();
    PolicyWalk walk(problem_, policy_, mover_, episode_.record);
    const policies::Insert insert = walk.Run(felt_, [&] { return IsRoughlyKnown(); });
    if (!insert.confirm) {
      // Open loop: at the middle of the hypotheses left.
      episode_.record.world_T_estimate =
          frame_.world_T_estimate * ToPose(walk.Mean([&](const auto& h) { return PoseOf(h); }));
      const BelievedInsertion verdict = Insert(*episode_.record.world_T_estimate);
      episode_.record.believed_inserted = verdict.inserted;
      return verdict.reason;
    }

    std::string reason = "no touch tells the pose";
    for (int insertion = 0; insertion < kInsertions; ++insertion) {
      const Knowledge knowledge = Localize(insertion == 0 ? kLeastTouches : kLeastTouches + 1);
      const PoseVector pose = knowledge.fits.front().pose;
      ExecutionRecord& record = episode_.record;
      record.believed_localized = true;
      record.world_T_estimate = frame_.world_T_estimate * ToPose(pose);
      if (insertion == 0) record.localization_time_s = episode_.robot.Time() - episode_.started_s;
      if (insertion > 0) record.FallBack("touch again", reason);
      const BelievedInsertion verdict = Insert(*record.world_T_estimate);
      record.believed_inserted = verdict.inserted;
      reason = verdict.reason;
      if (verdict.inserted || !episode_.options.ladder) return reason;
    }
    return reason;
  }

 private:
  Eigen::Vector3d Metres(const Eigen::Vector3d& cells) const { return (cells - frame_.center) * frame_.cell_m; }
  Eigen::Vector3d Cells(const Eigen::Vector3d& metres) const { return metres / frame_.cell_m + frame_.center; }

  /// Where the start belief says that the target may be, and a little more.
  void SetBox() {
    constexpr double kBeyond_m = 1e-3;
    constexpr double kBeyond_rad = 0.012;
    box_.lower.setConstant(std::numeric_limits<double>::infinity());
    box_.upper.setConstant(-std::numeric_limits<double>::infinity());
    for (const planner::Hypothesis& h : problem_.hypotheses) {
      const PoseVector pose = PoseOf(h);
      box_.lower = box_.lower.cwiseMin(pose);
      box_.upper = box_.upper.cwiseMax(pose);
    }
    for (const UncertainAxis& axis : task_.axes) {
      const int i = static_cast<int>(axis.kind);
      const double beyond = axis.angular() ? kBeyond_rad : 0.5 * axis.resolution + kBeyond_m;
      box_.lower[i] -= beyond;
      box_.upper[i] += beyond;
    }
  }

  PoseVector PoseOf(const planner::Hypothesis& h) const {
    PoseVector pose;
    pose.head<3>() = Metres(h.offset.cast<double>());
    const int pitches = LatticeAngles(task_, AxisKind::kPitch);
    pose[3] = LatticeAngle(task_, AxisKind::kYaw, h.orientation / pitches);
    pose[4] = LatticeAngle(task_, AxisKind::kPitch, h.orientation % pitches);
    return pose;
  }

  /// The workspace of the problem, and over it the height of the start, where nothing is met under any hypothesis.
  void SetSpace() {
    space_.insertion = task_.insertion;
    space_.lower_m = Metres(problem_.workspace.min.cast<double>() + problem_.map->phase());
    space_.upper_m = Metres(problem_.workspace.max.cast<double>() + problem_.map->phase());
    space_.clear_m = Metres(problem_.start.cast<double>() + problem_.map->phase())[along_];
    (out_ > 0 ? space_.upper_m : space_.lower_m)[along_] = space_.clear_m;
  }

  /// Lattice hypotheses that explain what was felt best, not two beside each other.
  std::vector<PoseVector> Starts() const {
    std::vector<std::pair<double, std::size_t>> ranked;
    for (std::size_t i = 0; i < problem_.hypotheses.size(); ++i) {
      const planner::Hypothesis& h = problem_.hypotheses[i];
      double cost = 0.0;
      for (const FeltMotion& felt : felt_) {
        constexpr double kCap = 2.0;
        const Eigen::Vector3d displacement = Cells(felt.motion.from_m) - h.offset.cast<double>();
        const double travel = ContinuousTravel(*problem_.map, displacement, felt.motion.direction, h.orientation);
        const double off = travel - felt.travelled_m / frame_.cell_m;
        const double capped = std::min(kCap, felt.contact ? std::abs(off) : std::max(0.0, -off));
        cost += capped * capped;
      }
      ranked.emplace_back(cost, i);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<PoseVector> starts;
    const double cell = 1.5 * frame_.cell_m;
    const double angle = 0.06;
    for (const auto& entry : ranked) {
      const PoseVector pose = PoseOf(problem_.hypotheses[entry.second]);
      const bool near = std::any_of(starts.begin(), starts.end(), [&](const PoseVector& other) {
        const PoseVector difference = (pose - other).cwiseAbs();
        return difference.head<3>().maxCoeff() < cell && difference.tail<2>().maxCoeff() < angle;
      });
      if (!near) starts.push_back(pose);
      if (static_cast<int>(starts.size()) == kStarts) break;
    }
    return starts;
  }

  Knowledge Know(const std::vector<PoseFit>& before) {
    std::vector<PoseVector> starts = Starts();
    for (std::size_t i = 0; i < std::min<std::size_t>(3, before.size()); ++i) starts.push_back(before[i].pose);
    Knowledge knowledge;
    knowledge.fits = FitPose(model_, felt_, box_, starts);
    RandomStream random(0, felt_.size(), "poses left");
    const double best = knowledge.fits.front().cost;
    for (const PoseFit& fit : knowledge.fits) {
      if (fit.cost > best + kRivals) break;
      const double weight = std::exp(-(fit.cost - best) / (0.25 * kRivals));
      knowledge.candidates.push_back({fit.pose, weight});
      // The pose is known no better than the geometry and the readings are.
      PoseMatrix covariance = 4.0 * fit.covariance;
      const Eigen::LLT<PoseMatrix> root(covariance + 1e-14 * PoseMatrix::Identity());
      const int samples = &fit == &knowledge.fits.front() ? kSamples : kSamples / 4;
      for (int i = 0; i < samples; ++i) {
        PoseVector normal;
        for (double& value : normal) value = random.Normal();
        const PoseVector pose = box_.Clamp(fit.pose + root.matrixL() * normal);
        knowledge.candidates.push_back({pose, weight / samples});
      }
    }
    Spread(knowledge);
    return knowledge;
  }

  void Spread(Knowledge& knowledge) const {
    double weight = 0.0;
    Eigen::Vector3d axis_mean = Eigen::Vector3d::Zero();
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    const Eigen::Vector3d inward = UnitVector(task_.insertion);
    for (const PoseCandidate& c : knowledge.candidates) {
      weight += c.weight;
      mean += c.weight * c.pose.head<3>();
      axis_mean += c.weight * (ToPose(c.pose).linear() * inward);
    }
    mean /= weight;
    axis_mean.normalize();
    double lateral = 0.0;
    double tilt = 0.0;
    for (const PoseCandidate& c : knowledge.candidates) {
      Eigen::Vector3d off = c.pose.head<3>() - mean;
      off[along_] = 0.0;
      lateral += c.weight * off.squaredNorm();
      tilt += c.weight * (ToPose(c.pose).linear() * inward - axis_mean).squaredNorm();
    }
    knowledge.lateral_m = std::sqrt(lateral / weight);
    knowledge.tilt_rad = std::sqrt(tilt / weight);
  }

  /// The continuous readings may tell the pose before the policy, which is told rounded ones, knows a hypothesis.
  bool IsRoughlyKnown() {
    const auto contacts = std::count_if(felt_.begin(), felt_.end(), [](const FeltMotion& f) { return f.contact; });
    if (contacts < kLeastContacts) return false;
    const Knowledge knowledge = Know({});
    return knowledge.lateral_m < kRoughly * kKnown_m && knowledge.tilt_rad < kRoughly * kKnown_rad;
  }

  /// Touches until the pose is known.
  Knowledge Localize(int least_touches) {
    Knowledge knowledge = Know({});
    int agreed = 0;
    for (int touch = 0; touches_ < kMostTouches; ++touch) {
      const bool known = knowledge.lateral_m < kKnown_m && knowledge.tilt_rad < kKnown_rad;
      const bool explained = knowledge.fits.front().worst_m < kWorst_m || agreed >= 3;
      if (known && explained && touch >= least_touches && agreed >= 1) break;
      const auto plan = ChooseTouch(model_, knowledge.candidates, space_, Metres(mover_.position()), ++touches_);
      if (!plan) break;
      const std::optional<FeltMotion> felt = Touch(*plan);
      if (felt) {
        const double foretold = PoseResiduals(model_, {*felt}, knowledge.fits.front().pose, 1.0)[0];
        agreed = felt->contact && std::abs(foretold) < kAgree_m ? agreed + 1 : 0;
        felt_.push_back(*felt);
      } else {
        agreed = 0;
      }
      knowledge = Know(knowledge.fits);
    }
    return knowledge;
  }

  /// Straight to a place, watched. False: something is in the way; the tool has come off it.
  bool Go(const Eigen::Vector3d& place, const char* kind) {
    const Eigen::Vector3d from = mover_.position();
    if ((place - from).norm() < 0.02) return true;
    const MotionReport report = mover_.Fast(place, kind);
    const auto direction = DirectionOf(place - from);
    if (direction && (report.end - from).norm() > 0.5) {
      felt_.push_back(FeltFrom(frame_, *direction, from, report, kFastSigma_m));
    }
    if (!report.contact) return true;
    const Eigen::Vector3d back = from - report.end;
    mover_.Retreat(back.norm() > 1.0 ? Eigen::Vector3d(report.end + back.normalized()) : from);
    return false;
  }

  /// Away from the target to `up`. A tool that has dipped into the mouth meets its walls on the way: it is drawn out
  /// compliantly. False: it is held.
  bool ComeUp(const Eigen::Vector3d& up, const char* kind) {
    if (Go(up, kind)) return true;
    mover_.Press({up}, kDrawOut_m_s, kind);
    mover_.ZeroWrench();
    return out_ * (up - mover_.position())[along_] < kDrawnOut;
  }

  /// To the clear height, over the place, down to it.
  bool GoTo(const Eigen::Vector3d& place) {
    const double clear = Cells(Eigen::Vector3d::Constant(space_.clear_m))[along_];
    Eigen::Vector3d up = mover_.position();
    Eigen::Vector3d off = place - up;
    const bool beside = std::abs(off[(along_ + 1) % 3]) + std::abs(off[(along_ + 2) % 3]) > 0.05;
    if (beside) {
      if (out_ * (clear - up[along_]) > 0.02) {
        up[along_] = clear;
        if (!ComeUp(up, "transfer")) return false;
      }
      Eigen::Vector3d over = place;
      over[along_] = mover_.position()[along_];
      if (!Go(over, "transfer")) return false;
    }
    return Go(place, "transfer");
  }

  std::optional<FeltMotion> Touch(const TouchPlan& plan) {
    const Direction direction = plan.motion.direction;
    const int axis = AxisOf(direction);
    const int sign = SignOf(direction);
    if (!GoTo(Cells(plan.motion.from_m))) return std::nullopt;
    const Eigen::Vector3d begun = mover_.position();
    const double nearest = plan.nearest_m / frame_.cell_m;
    const double farthest = plan.farthest_m / frame_.cell_m;
    const double fast = nearest - 1.25;
    if (fast > 1.0) {
      const MotionReport report = mover_.Fast(begun + fast * UnitVector(direction), "transfer");
      if (report.contact) mover_.Retreat(report.end - UnitVector(direction));
    }
    const double end = begun[axis] + sign * (farthest + 1.5);
    const double gone = sign * (mover_.position()[axis] - begun[axis]);
    const MotionReport report =
        mover_.Probe(direction, end, "confirm", std::array<double, 2>{nearest - gone, farthest - gone});
    const FeltMotion felt = FeltFrom(frame_, direction, begun, report, kProbeSigma_m);
    mover_.Retreat(report.end - std::min(1.0, felt.travelled_m / frame_.cell_m) * UnitVector(direction));
    return felt;
  }

  BelievedInsertion Insert(const Pose& world_T_target) {
    Eigen::Vector3d up = mover_.position();
    const double clear = Cells(Eigen::Vector3d::Constant(space_.clear_m))[along_];
    if (out_ * (clear - up[along_]) > 0.02) up[along_] = clear;
    if (!ComeUp(up, "approach")) return {false, false, "insertion: unexpected contact on the way up"};
    const LatticeFrame aligned{world_T_target, Eigen::Vector3d::Zero(), frame_.cell_m};
    Mover mover(episode_.robot, aligned, episode_.task.insertion, episode_.options, episode_.record,
                episode_.started_s);
    const Eigen::Vector3d outward = out_ * Eigen::Vector3d::Unit(along_);
    BelievedInsertion verdict{false, true, "insertion: unexpected contact in front of the opening"};
    bool met = false;
    for (const double standoff_m : {std::max(kStandoff_m, std::abs(space_.clear_m)), kNearStandoff_m}) {
      met = mover.Fast(standoff_m / frame_.cell_m * outward, "approach").contact;
      if (met) break;
    }
    if (!met) {
      mover.ZeroWrench();
      verdict =
          InsertFromHere(task_, Eigen::Vector3d::Zero(), 2.0 * mover.Cells(task_.tolerance.LargestLateral()), mover);
      if (verdict.inserted) return verdict;
    }
    // Off the mouth along the opening, then back to the orientation of the frame.
    Eigen::Vector3d off = mover.position();
    const double standoff = std::max(kStandoff_m, std::abs(space_.clear_m)) / frame_.cell_m;
    if (out_ * off[along_] < standoff) off[along_] = out_ * standoff;
    mover.Retreat(off);
    Eigen::Vector3d place = frame_.FromWorld(aligned.ToWorld(off));
    if (out_ * (clear - place[along_]) > 0.0) place[along_] = clear;
    mover_.Retreat(place);
    return verdict;
  }

  const Episode& episode_;
  const Task& task_;
  const planner::Problem& problem_;
  policies::Policy& policy_;
  planner::TravelModel& model_;
  LatticeFrame frame_;
  Mover mover_;
  int along_;
  int out_;
  PoseBox box_;
  TouchSpace space_;
  std::vector<FeltMotion> felt_;
  std::uint64_t touches_ = 0;
};

}  // namespace

bool HasAngles(const planner::Problem& problem) {
  return std::any_of(problem.hypotheses.begin(), problem.hypotheses.end(), [&](const planner::Hypothesis& h) {
    return h.orientation != problem.hypotheses.front().orientation;
  });
}

std::string RunPoseAttempt(const Episode& episode, const planner::Problem& problem, const Pose& world_T_estimate,
                           policies::Policy& policy, planner::TravelModel& model) {
  return PoseAttempt(episode, problem, world_T_estimate, policy, model).Run();
}

}  // namespace feeler::execution
