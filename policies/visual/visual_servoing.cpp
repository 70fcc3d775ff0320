#include "feeler/policies/visual/visual_servoing.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::policies {
namespace {

ImagePoint Normalised(const CameraView& view, const Eigen::Vector2d& px) {
  return {(px.x() - view.cx) / view.fx, (px.y() - view.cy) / view.fy};
}

Servo Follow(const CameraTwist& twist, double duration_s, const Pose& tool_T_camera) {
  Servo servo;
  servo.motion.tool_T_frame = tool_T_camera;
  servo.motion.linear_m_s = twist.head<3>();
  servo.motion.angular_rad_s = twist.tail<3>();
  servo.motion.duration_s = duration_s;
  return servo;
}

}  // namespace

void VisualServoingOptions::Validate() const {
  const std::pair<const char*, double> positive[] = {{"gain_per_s", gain_per_s},
                                                     {"frame_period_s", frame_period_s},
                                                     {"speed_limit_m_s", speed_limit_m_s},
                                                     {"angular_speed_limit_rad_s", angular_speed_limit_rad_s},
                                                     {"reached_m", reached_m},
                                                     {"reached_frames", reached_frames},
                                                     {"lost_frames", lost_frames},
                                                     {"frame_limit", frame_limit},
                                                     {"farthest_m", farthest_m}};
  for (const auto& [field, value] : positive) {
    if (!(value > 0.0) || !std::isfinite(value)) {
      throw InputError("visual servoing", fmt::format("{} is {}", field, value), "give a finite number above zero");
    }
  }
  if (gain_per_s * frame_period_s >= 2.0) {
    throw InputError("visual servoing", "the gain is too high for the frame period",
                     "keep gain_per_s * frame_period_s below 2, better below 0.5");
  }
}

VisualServoingPolicy::VisualServoingPolicy(std::string name, std::shared_ptr<const VisualGoal> goal,
                                           std::unique_ptr<FeatureTracker> tracker,
                                           const VisualServoingOptions& options)
    : name_(std::move(name)), goal_(std::move(goal)), tracker_(std::move(tracker)), options_(options) {
  options_.Validate();
}

void VisualServoingPolicy::Begin(const planner::Problem& /*problem*/) {
  frames_ = reached_ = lost_ = 0;
  commanded_m_.setZero();
  start_R_camera_.setIdentity();
  next_ = Servo{};  // look, without moving
}

Decision VisualServoingPolicy::Next(const Belief& /*belief*/) { return next_; }

bool VisualServoingPolicy::Observe(const Outcome& /*outcome*/) { return false; }

void VisualServoingPolicy::See(const CameraView& view) {
  ++frames_;
  if (view.width == 0) {
    next_ = GiveUp{"the robot has no camera"};
    return;
  }
  const FeatureMatches found = tracker_->Match(view);
  if (found.matches.empty()) {
    reached_ = 0;
    if (++lost_ >= options_.lost_frames) {
      next_ = GiveUp{fmt::format("features lost: {}", found.lost)};
    } else {  // stand and look again
      next_ = Follow(CameraTwist::Zero(), options_.frame_period_s, view.tool_T_camera);
    }
    return;
  }
  lost_ = 0;
  std::vector<ServoPoint> points;
  double farthest = 0.0;
  for (const FeatureMatch& match : found.matches) {
    points.push_back({Normalised(view, match.seen_px), Normalised(goal_->view, match.goal_px), match.goal_depth_m});
    farthest = std::max(farthest, (points.back().seen - points.back().goal).norm());
  }
  const CameraTwist step = ServoStep(points, options_.freedom);
  if (step.isZero(0.0) && farthest > 0.0) {
    next_ = GiveUp{"the features do not tell where to go"};
    return;
  }
  reached_ = step.head<3>().norm() < options_.reached_m ? reached_ + 1 : 0;
  if (reached_ >= options_.reached_frames) {
    next_ = Insert{false, goal_->tool_T_target};
    return;
  }
  if (frames_ >= options_.frame_limit) {
    next_ =
        GiveUp{fmt::format("no convergence after {} pictures, {:.2f} mm to go", frames_, 1e3 * step.head<3>().norm())};
    return;
  }
  CameraTwist twist = options_.gain_per_s * step;
  const double excess = std::max(twist.head<3>().norm() / options_.speed_limit_m_s,
                                 twist.tail<3>().norm() / options_.angular_speed_limit_rad_s);
  if (excess > 1.0) twist /= excess;
  commanded_m_ += start_R_camera_ * twist.head<3>() * options_.frame_period_s;
  const Eigen::Vector3d turn = twist.tail<3>() * options_.frame_period_s;
  if (turn.norm() > 0.0) start_R_camera_ = start_R_camera_ * Eigen::AngleAxisd(turn.norm(), turn.normalized());
  if (commanded_m_.norm() > options_.farthest_m) {
    next_ = GiveUp{fmt::format("led astray: {:.0f} mm from the start", 1e3 * commanded_m_.norm())};
    return;
  }
  next_ = Follow(twist, options_.frame_period_s, view.tool_T_camera);
}

}  // namespace feeler::policies
