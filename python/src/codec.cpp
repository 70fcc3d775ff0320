#include "codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "feeler/core/error.h"

namespace feeler::python {
namespace {

/// What a force-torque sensor of this kind of arm measures; and what a motion can travel.
constexpr double kForceRange_n = 1000.0;
constexpr double kTorqueRange_nm = 100.0;
constexpr double kTravelRange_m = 10.0;

double Bound(const env::SpaceComponent& c, double value) {
  if (std::isfinite(value)) return value;
  const double range = c.unit == "N" ? kForceRange_n : c.unit == "Nm" ? kTorqueRange_nm : kTravelRange_m;
  return std::copysign(range, value);
}

std::vector<double> Bounds(bool high) {
  std::vector<double> bounds;
  for (const env::SpaceComponent& c : env::ObservationSpace().components)
    bounds.push_back(Bound(c, high ? c.high : c.low));
  return bounds;
}

Eigen::Vector3d Shortened(const Eigen::Vector3d& v, double longest) {
  const double norm = v.norm();
  // A hair below, so that rounding does not make it longer than the environment takes.
  return norm > longest ? Eigen::Vector3d(v * (longest * (1.0 - 1e-12) / norm)) : v;
}

/// A share in [-1, 1] of the way from `low` to `high`.
double Between(double share, double low, double high) { return low + 0.5 * (share + 1.0) * (high - low); }

env::Action DecodeControl(const CodecOptions& options, std::span<const double> v) {
  env::LowLevelAction action;
  action.delta << Shortened(Eigen::Vector3d(v[0], v[1], v[2]) * options.max_displacement_m, options.max_displacement_m),
      Shortened(Eigen::Vector3d(v[3], v[4], v[5]) * options.max_turn_rad, options.max_turn_rad);
  action.steps = options.control_steps;
  return action;
}

constexpr double kLongestMove_m = 0.1;
constexpr double kFastest_m_s = 0.1;
constexpr double kContact_n = 5.0;
constexpr double kInsertionForce_n = 60.0;

env::InsertAction Insertion(const Task& task, double speed_m_s, double force_n) {
  env::InsertAction action;
  // From the mouth to the ground, as if the tool stood a little above the mouth.
  action.distance_m = task.insertion_depth_m + 2.0 * task.cell_m;
  action.speed_m_s = speed_m_s;
  action.force_limit_n = force_n;
  return action;
}

env::Action DecodeMacro(std::span<const double> v, const env::InsertionEnv& environment) {
  const Task& task = environment.task();
  const Pose& estimate = environment.world_T_estimate();
  const auto verb = std::max_element(v.begin(), v.begin() + 3) - v.begin();
  const Eigen::Vector3d vector(v[3], v[4], v[5]);
  const double speed_m_s = Between(v[7], 0.005, kFastest_m_s);
  if (verb == 1) {
    env::TransferAction action;
    action.straight = true;
    action.speed_m_s = Between(v[7], 0.02, 0.25);
    action.world_T_tool = env::NominalStartPose(task, estimate);
    action.world_T_tool.translation() += estimate.linear() * vector.cwiseProduct(task.workspace_m);
    return action;
  }
  if (verb == 2) return Insertion(task, std::min(speed_m_s, 0.05), Between(v[6], 5.0, kInsertionForce_n));
  env::GuardedMoveAction action;
  const double norm = vector.norm();
  action.motion.direction = norm > 1e-6 ? Eigen::Vector3d(estimate.linear() * vector / norm)
                                        : Eigen::Vector3d(estimate.linear() * UnitVector(task.insertion));
  action.motion.direction.normalize();
  action.motion.distance_m = Between(v[6], 0.0005, kLongestMove_m);
  action.motion.speed_m_s = speed_m_s;
  action.motion.contact_force_n = kContact_n;
  return action;
}

env::Action DecodeDiscrete(std::span<const double> v, const env::InsertionEnv& environment) {
  const Task& task = environment.task();
  const Pose& estimate = environment.world_T_estimate();
  const auto verb = static_cast<int>(v[0]);
  const double length_m = kDiscreteLengths[static_cast<std::size_t>(v[1])] * task.cell_m;
  const double speed_m_s = kDiscreteSpeeds_m_s[static_cast<std::size_t>(v[2])];
  if (verb == 6) {
    env::TransferAction action;
    action.straight = true;
    action.world_T_tool = env::NominalStartPose(task, estimate);
    return action;
  }
  if (verb == 7) return Insertion(task, speed_m_s, kInsertionForce_n);
  env::GuardedMoveAction action;
  action.motion.direction = (estimate.linear() * UnitVector(kDirections[static_cast<std::size_t>(verb)])).normalized();
  action.motion.distance_m = length_m;
  action.motion.speed_m_s = speed_m_s;
  action.motion.contact_force_n = kContact_n;
  return action;
}

void RequireInSpace(ActionFormat format, std::span<const double> v) {
  const int size = SizeOf(format);
  if (v.size() != static_cast<std::size_t>(size)) {
    throw InputError("action", fmt::format("{} numbers", v.size()), fmt::format("give {}", size));
  }
  const int sizes[] = {kVerbs, static_cast<int>(std::size(kDiscreteLengths)),
                       static_cast<int>(std::size(kDiscreteSpeeds_m_s))};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const bool discrete = format == ActionFormat::kMacroDiscrete;
    const double low = discrete ? 0.0 : -1.0;
    const double high = discrete ? sizes[i] - 1 : 1.0;
    if (v[i] >= low && v[i] <= high && (!discrete || v[i] == std::floor(v[i]))) continue;
    throw InputError("action", fmt::format("number {} is {}", i, v[i]),
                     fmt::format("give {} to {}{}", low, high, discrete ? ", whole" : ""));
  }
}

}  // namespace

ActionFormat ParseFormat(std::string_view name) {
  if (name == "control") return ActionFormat::kControl;
  if (name == "macro") return ActionFormat::kMacro;
  if (name == "macro-discrete") return ActionFormat::kMacroDiscrete;
  throw InputError("actions", "unknown kind \"" + std::string(name) + "\"", "choose control, macro or macro-discrete");
}

void CodecOptions::Validate(const env::ActionBounds& bounds) const {
  const auto require = [](bool ok, const char* name, double value, double most) {
    if (!ok) throw InputError(name, fmt::format("is {}", value), fmt::format("give more than 0, at most {}", most));
  };
  require(control_steps >= 1 && control_steps <= bounds.steps, "control_steps", control_steps, bounds.steps);
  require(max_displacement_m > 0.0 && max_displacement_m <= bounds.delta_m, "max_displacement_m", max_displacement_m,
          bounds.delta_m);
  require(max_turn_rad > 0.0 && max_turn_rad <= bounds.delta_rad, "max_turn_rad", max_turn_rad, bounds.delta_rad);
  if (!std::isfinite(reward_progress)) throw InputError("reward_progress", "is not finite", "give a number");
}

int SizeOf(ActionFormat format) {
  switch (format) {
    case ActionFormat::kControl: return 6;
    case ActionFormat::kMacro: return 8;
    case ActionFormat::kMacroDiscrete: return 3;
  }
  return 0;
}

env::Action Decode(const CodecOptions& options, std::span<const double> values, const env::InsertionEnv& environment) {
  RequireInSpace(options.format, values);
  switch (options.format) {
    case ActionFormat::kControl: return DecodeControl(options, values);
    case ActionFormat::kMacro: return DecodeMacro(values, environment);
    case ActionFormat::kMacroDiscrete: break;
  }
  return DecodeDiscrete(values, environment);
}

const std::vector<double>& ObservationLow() {
  static const std::vector<double> low = Bounds(false);
  return low;
}
const std::vector<double>& ObservationHigh() {
  static const std::vector<double> high = Bounds(true);
  return high;
}

void Saturate(std::span<double> observation) {
  const std::vector<double>& low = ObservationLow();
  const std::vector<double>& high = ObservationHigh();
  for (std::size_t i = 0; i < observation.size(); ++i) observation[i] = std::clamp(observation[i], low[i], high[i]);
}

double DistanceToGoal(const env::InsertionEnv& environment, std::span<const double> observation,
                      const Pose& world_T_target) {
  const Task& task = environment.task();
  const Eigen::Vector3d goal = world_T_target * Eigen::Vector3d(task.insertion_depth_m * UnitVector(task.insertion));
  return (Eigen::Vector3d(observation[12], observation[13], observation[14]) - goal).norm();
}

}  // namespace feeler::python
