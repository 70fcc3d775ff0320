#include "feeler/execution/remote/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "feeler/core/error.h"

namespace feeler::execution {
namespace {

constexpr double kNotWatched_n = 1e6;

/// Moves over and around the block; every way in between is watched.
class Prober {
 public:
  Prober(Robot& robot, const KnownBlock& block, const CalibrationSettings& settings)
      : robot_(robot), block_(block), settings_(settings), orientation_(robot.ToolPose().linear()) {}

  double above() const { return block_.max_m.z() + settings_.clearance_m; }

  void GoTo(const Eigen::Vector3d& place_m, bool leaves_contact = false) {
    Pose goal = Pose::Identity();
    goal.linear() = orientation_;
    goal.translation() = place_m;
    constexpr double kSpeed_m_s = 0.1;
    const MotionResult result =
        robot_.LinearMove(goal, kSpeed_m_s, leaves_contact ? kNotWatched_n : settings_.contact_force_n);
    if (result.reason != StopReason::kReached) Fail("a way around the block", result);
  }

  /// Where the tool reference is when it meets the block.
  MotionResult Touch(const Eigen::Vector3d& direction, double speed_m_s, double force_n) {
    GuardedMotion motion;
    motion.direction = direction;
    constexpr double kBeyond_m = 0.02;
    motion.distance_m = settings_.clearance_m + settings_.reach_m + kBeyond_m;
    motion.speed_m_s = speed_m_s;
    motion.contact_force_n = force_n;
    const MotionResult result = robot_.Guarded(motion);
    if (result.reason != StopReason::kContact) Fail("a touch", result);
    return result;
  }

  /// Down onto the top at a place, and up again.
  MotionResult TouchTop(double x_m, double y_m, double speed_m_s, double force_n) {
    GoTo({x_m, y_m, above()});
    robot_.ZeroWrench();
    const MotionResult result = Touch(-Eigen::Vector3d::UnitZ(), speed_m_s, force_n);
    GoTo({x_m, y_m, above()}, true);
    return result;
  }

  /// Against a side of the block from outside, at its middle; the coordinate across it.
  double TouchSide(int axis, int side) {
    Eigen::Vector3d place = 0.5 * (block_.min_m + block_.max_m);
    place[axis] = side < 0 ? block_.min_m[axis] - settings_.reach_m : block_.max_m[axis] + settings_.reach_m;
    place.z() = above();
    GoTo(place);
    place.z() = block_.max_m.z() - settings_.depth_m;
    GoTo(place);
    robot_.ZeroWrench();
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    direction[axis] = -side;
    const double met_m =
        Touch(direction, settings_.speed_m_s, settings_.contact_force_n).world_T_tool.translation()[axis];
    GoTo(place, true);
    place.z() = above();
    GoTo(place);
    return met_m;
  }

  void Tell(const std::string& text) const {
    if (settings_.tell) settings_.tell(text);
  }

 private:
  [[noreturn]] static void Fail(const std::string& what, const MotionResult& result) {
    throw WorldError("calibration",
                     fmt::format("{} ended otherwise: {}{}{}", what, ToString(result.reason),
                                 result.detail.empty() ? "" : ", ", result.detail),
                     "put the tool above the block, and say where the block stands (--block)");
  }

  Robot& robot_;
  const KnownBlock& block_;
  const CalibrationSettings& settings_;
  Eigen::Matrix3d orientation_;
};

/// Mean and spread of the force at rest.
void MeasureSensor(Robot& robot, Prober& prober, const CalibrationSettings& settings, CellFile& cell) {
  prober.Tell("the sensor at rest");
  const Eigen::Vector3d here = robot.ToolPose().translation();
  std::vector<Eigen::Vector3d> forces;
  constexpr double kStep_m = 0.001;  // a robot in lockstep has no time without motion
  for (int i = 0; i < settings.samples; ++i) {
    prober.GoTo(here + Eigen::Vector3d(0.0, 0.0, i % 2 == 0 ? kStep_m : 0.0), true);
    forces.push_back(robot.ContactWrench().force_n);
  }
  prober.GoTo(here, true);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& force : forces) mean += force / static_cast<double>(forces.size());
  double variance = 0.0;
  for (const Eigen::Vector3d& force : forces) {
    variance += (force - mean).squaredNorm() / (3.0 * static_cast<double>(forces.size() - 1));
  }
  cell.force_bias_n = mean.norm();
  cell.force_noise_n = std::sqrt(variance);
}

void MeasureContact(Prober& prober, const Eigen::Vector3d& middle, const CalibrationSettings& settings,
                    CellFile& cell) {
  prober.Tell("stiffness and reaction");
  const auto touch = [&](double speed_m_s, double force_n) {
    return prober.TouchTop(middle.x(), middle.y(), speed_m_s, force_n);
  };
  const MotionResult soft = touch(settings.speed_m_s, settings.contact_force_n);
  const MotionResult hard = touch(settings.speed_m_s, settings.hard_force_n);
  const double deeper_m = soft.world_T_tool.translation().z() - hard.world_T_tool.translation().z();
  constexpr double kLeast_m = 1e-6;
  cell.stiffness_n_m = (settings.hard_force_n - settings.contact_force_n) / std::max(deeper_m, kLeast_m);
  // While the robot does not react yet the force grows with the way: F = threshold + k v t.
  const MotionResult fast = touch(settings.fast_speed_m_s, settings.contact_force_n);
  const double faster_m_s = settings.fast_speed_m_s - settings.speed_m_s;
  const double more_n = fast.peak_force_n - soft.peak_force_n;
  cell.reaction_time_s = std::max(0.0, more_n / (*cell.stiffness_n_m * faster_m_s));
}

}  // namespace

CellFile Calibrate(Robot& robot, const KnownBlock& block, const CalibrationSettings& settings) {
  if (!((block.max_m - block.min_m).array() > 0.0).all()) {
    throw InputError("--block", "the block has no room", "give its least and greatest corner");
  }
  Prober prober(robot, block, settings);
  const Eigen::Vector3d middle = 0.5 * (block.min_m + block.max_m);
  const Eigen::Vector3d here = robot.ToolPose().translation();
  if (here.z() < block.max_m.z() + 0.5 * settings.clearance_m) {
    throw InputError(
        "--block",
        fmt::format("the tool stands at {:.3f} m, the top of the block at {:.3f} m", here.z(), block.max_m.z()),
        "put the tool above the block");
  }
  CellFile cell;
  MeasureSensor(robot, prober, settings, cell);
  const double told_n = 4.0 + 6.0 * *cell.force_noise_n;
  cell.contact_force_n = std::max(5.0, told_n);

  prober.Tell("the top of the block");
  const Eigen::Vector3d size = block.max_m - block.min_m;
  double height_m = 0.0;
  constexpr int kPlaces = 3;
  for (int i = 0; i < kPlaces; ++i) {
    const double x_m = middle.x() + 0.25 * size.x() * (i - 1);
    const double y_m = middle.y() + 0.25 * size.y() * (i == 1 ? 1 : 0);
    const MotionResult met = prober.TouchTop(x_m, y_m, settings.speed_m_s, settings.contact_force_n);
    height_m += met.world_T_tool.translation().z() / kPlaces;
  }
  MeasureContact(prober, middle, settings, cell);
  cell.tool_offset_m.z() =
      block.max_m.z() - (height_m + settings.contact_force_n / *cell.stiffness_n_m);  // less the give of the contact
  if (!settings.sides) return cell;
  for (int axis = 0; axis < 2; ++axis) {
    prober.Tell(axis == 0 ? "the sides across x" : "the sides across y");
    const double low_m = prober.TouchSide(axis, -1);
    const double high_m = prober.TouchSide(axis, 1);
    cell.tool_offset_m[axis] = middle[axis] - 0.5 * (low_m + high_m);
  }
  return cell;
}

}  // namespace feeler::execution
