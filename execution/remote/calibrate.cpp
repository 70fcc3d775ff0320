#include "feeler/execution/remote/calibrate.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/error.h"

namespace feeler::execution {
namespace {

constexpr double kLetGo_n = 1e6;
/// What is pressed with for the stiffness is so much harder than a touch, where the robot takes it.
constexpr double kHarder = 2.5;
constexpr double kMore_n = 10.0;
constexpr double kLeastHarder = 1.5;

/// What to do about a motion that ended otherwise.
std::string Mend(const MotionResult& result, bool touch) {
  const auto says = [&](const char* word) { return result.detail.find(word) != std::string::npos; };
  if (says("protective stop")) return "look at the robot, free it, and begin again";
  if (says("link lost")) return "see that the robot's program runs and that the network holds";
  if (says("by order")) return "begin again";
  switch (result.reason) {
    case StopReason::kReached: return "nothing was met there: say where the block stands (--block)";
    case StopReason::kContact:
      return "clear the way around the block, or give more --clearance, --reach or --contact-force";
    case StopReason::kUnplanned: return "see that block and --reach lie within --box and what the robot can reach";
    default: return touch ? "see what the robot says, and begin again" : "clear the way around the block";
  }
}

/// Moves over and around the block; every way in between is watched.
class Prober {
 public:
  Prober(Robot& robot, const KnownBlock& block, const CalibrationSettings& settings)
      : robot_(robot), block_(block), settings_(settings), orientation_(robot.ToolPose().linear()) {}

  double above() const { return block_.max_m.z() + settings_.clearance_m; }

  void GoTo(const Eigen::Vector3d& place_m, bool leaves_contact = false) {
    const MotionResult result =
        Straight(place_m, settings_.way_speed_m_s, leaves_contact ? kLetGo_n : settings_.contact_force_n);
    if (result.reason != StopReason::kReached) Fail("a way around the block", result, false);
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
    if (result.reason != StopReason::kContact) Fail("a touch", result, true);
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

  /// Presses onto the top by small steps up to a force: heights and forces upwards at rest, which know nothing of what
  /// a contact adds while the tool moves.
  std::vector<Eigen::Vector2d> PressTop(double x_m, double y_m, double least_n, double most_n) {
    constexpr double kSlower = 0.02;
    constexpr int kMostSteps = 200;
    constexpr double kLongestStep_m = 2e-4;
    constexpr double kLongestToContact_m = 1e-5;
    const double speed_m_s = kSlower * settings_.speed_m_s;
    GoTo({x_m, y_m, above()});
    robot_.ZeroWrench();
    Eigen::Vector3d place =
        Touch(-Eigen::Vector3d::UnitZ(), settings_.speed_m_s, settings_.contact_force_n).world_T_tool.translation();
    std::vector<Eigen::Vector2d> points;
    double step_m = 5e-6;
    double before_n = 0.0;
    MotionResult result = Straight(place, speed_m_s, kLetGo_n);
    for (int i = 0; i < kMostSteps && result.reason == StopReason::kReached; ++i) {
      const double force_n = robot_.ContactWrench().force_n.z();
      if (force_n > most_n) break;
      if (force_n > least_n) points.emplace_back(robot_.ToolPose().translation().z(), force_n);
      const double longest_m = force_n > least_n ? kLongestStep_m : kLongestToContact_m;
      if (force_n - before_n < 0.05 * most_n) step_m = std::min(2.0 * step_m, longest_m);
      before_n = force_n;
      place.z() -= step_m;
      result = Straight(place, speed_m_s, most_n);
    }
    if (result.reason != StopReason::kReached && result.reason != StopReason::kContact) Fail("a press", result, true);
    const bool met = result.contact || robot_.ContactWrench().force_n.z() > most_n;
    GoTo({x_m, y_m, above()}, true);
    if (met) return points;
    throw WorldError("calibration", fmt::format("pressing onto the block never meets {:g} N: it gives way", most_n),
                     "fix the block, or give a lower --contact-force");
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
  MotionResult Straight(const Eigen::Vector3d& place_m, double speed_m_s, double force_n) {
    Pose goal = Pose::Identity();
    goal.linear() = orientation_;
    goal.translation() = place_m;
    return robot_.LinearMove(goal, speed_m_s, force_n);
  }

  [[noreturn]] static void Fail(const std::string& what, const MotionResult& result, bool touch) {
    throw WorldError("calibration",
                     fmt::format("{} ended otherwise: {}{}{}", what, ToString(result.reason),
                                 result.detail.empty() ? "" : ", ", result.detail),
                     Mend(result, touch));
  }

  Robot& robot_;
  const KnownBlock& block_;
  const CalibrationSettings& settings_;
  Eigen::Matrix3d orientation_;
};

/// Mean and spread of the force at rest, which is zero from then on.
void MeasureSensor(Robot& robot, Prober& prober, const CalibrationSettings& settings, CellFile& cell) {
  prober.Tell("the sensor at rest");
  const Eigen::Vector3d here = robot.ToolPose().translation();
  std::vector<Eigen::Vector3d> forces;
  constexpr double kStep_m = 0.001;                              // a robot in lockstep has no time without motion
  prober.GoTo(here + Eigen::Vector3d(0.0, 0.0, kStep_m), true);  // a filter settles
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
  robot.ZeroWrench();  // the ways that follow are watched
  cell.force_bias_n = mean.norm();
  cell.force_noise_n = std::sqrt(variance);
}

/// Throws InputError where the robot takes no force by which a stiffness could be told.
double HarderForce(const CalibrationSettings& settings) {
  const double wished_n = std::max(kHarder * settings.contact_force_n, settings.contact_force_n + kMore_n);
  const double hard_n = std::min(wished_n, settings.most_force_n);
  if (hard_n >= kLeastHarder * settings.contact_force_n) return hard_n;
  throw InputError("--contact-force",
                   fmt::format("{:g} N leaves nothing harder to press with: the robot takes {:g} N",
                               settings.contact_force_n, settings.most_force_n),
                   fmt::format("give at most {:.3g}", settings.most_force_n / kLeastHarder));
}

/// Force over depth, by least squares; empty where the points tell none: a contact stiffer than depths are told.
std::optional<double> Stiffness(const std::vector<Eigen::Vector2d>& points, double noise_n) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : points) mean += point / static_cast<double>(points.size());
  double across = 0.0;
  double square = 0.0;
  Eigen::AlignedBox2d range;
  for (const Eigen::Vector2d& point : points) {
    across += (point.x() - mean.x()) * (point.y() - mean.y());
    square += (point.x() - mean.x()) * (point.x() - mean.x());
    range.extend(point);
  }
  constexpr std::size_t kLeastPoints = 3;
  constexpr double kLeastDepth_m = 3e-7;
  const bool told = points.size() >= kLeastPoints && range.sizes().x() > kLeastDepth_m &&
                    range.sizes().y() > 6.0 * noise_n && across < 0.0;
  if (told) return -across / square;
  return {};
}

void MeasureContact(Prober& prober, const Eigen::Vector3d& middle, const CalibrationSettings& settings,
                    CellFile& cell) {
  prober.Tell("stiffness and reaction");
  const double noise_n = *cell.force_noise_n;
  const double hard_n = HarderForce(settings);
  const double least_n = std::max(0.4 * hard_n, 3.0 * noise_n);  // lighter ones still slip into place
  cell.stiffness_n_m = Stiffness(prober.PressTop(middle.x(), middle.y(), least_n, hard_n), noise_n);
  if (!cell.stiffness_n_m) {
    prober.Tell("stiffness and reaction time are left out: the contact is stiffer than the robot tells depths");
    return;
  }
  // While the robot does not react yet the force grows with the way: F = threshold + k v t.
  const auto peak_n = [&](double speed_m_s) {
    return prober.TouchTop(middle.x(), middle.y(), speed_m_s, settings.contact_force_n).peak_force_n;
  };
  const double more_n = peak_n(settings.fast_speed_m_s) - peak_n(settings.speed_m_s);
  if (more_n > 3.0 * noise_n) {
    cell.reaction_time_s = more_n / (*cell.stiffness_n_m * (settings.fast_speed_m_s - settings.speed_m_s));
  } else {
    prober.Tell(fmt::format("the reaction time is left out: at {:g} m/s a touch pushes {:.2f} N harder than at {:g}",
                            settings.fast_speed_m_s, more_n, settings.speed_m_s));
  }
}

/// What feeler execute would not read is not handed on.
void RequirePlausible(const CellFile& cell) {
  constexpr double kLeastStiffness_n_m = 100.0;
  constexpr double kMostOffset_m = 0.05;
  if (cell.stiffness_n_m && *cell.stiffness_n_m < kLeastStiffness_n_m) {
    throw WorldError("calibration", fmt::format("the block gives way: {:.3g} N/m", *cell.stiffness_n_m), "fix it");
  }
  if (const double off_m = cell.tool_offset_m.norm(); off_m > kMostOffset_m) {
    throw WorldError("calibration", fmt::format("the tool centre point is off by {:.0f} mm", 1e3 * off_m),
                     "teach it to the robot first, or say where the block stands (--block)");
  }
}

}  // namespace

CellFile Calibrate(Robot& robot, const KnownBlock& block, const CalibrationSettings& settings) {
  if (!((block.max_m - block.min_m).array() > 0.0).all()) {
    throw InputError("--block", "the block has no room", "give its least and greatest corner");
  }
  HarderForce(settings);
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
  const double give_m = cell.stiffness_n_m ? settings.contact_force_n / *cell.stiffness_n_m : 0.0;
  cell.tool_offset_m.z() = block.max_m.z() - (height_m + give_m);
  for (int axis = 0; axis < 2 && settings.sides; ++axis) {
    prober.Tell(axis == 0 ? "the sides across x" : "the sides across y");
    const double low_m = prober.TouchSide(axis, -1);
    const double high_m = prober.TouchSide(axis, 1);
    cell.tool_offset_m[axis] = middle[axis] - 0.5 * (low_m + high_m);
  }
  RequirePlausible(cell);
  return cell;
}

}  // namespace feeler::execution
