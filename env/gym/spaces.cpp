#include "feeler/env/gym/spaces.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

void Add(Space& space, std::initializer_list<const char*> names, const char* unit, double low, double high) {
  for (const char* name : names) space.components.push_back({name, unit, low, high});
}

Space MakeObservationSpace() {
  // Joints move within +-2 pi; the world calls itself broken beyond 1000 rad/s (env/scene/world.h).
  constexpr double kJoint_rad = 7.0;
  constexpr double kJointSpeed_rad_s = 1000.0;
  constexpr double kReach_m = 2.0;
  Space space{"observation", {}, {}};
  Add(space, {"q.0", "q.1", "q.2", "q.3", "q.4", "q.5"}, "rad", -kJoint_rad, kJoint_rad);
  Add(space, {"qd.0", "qd.1", "qd.2", "qd.3", "qd.4", "qd.5"}, "rad/s", -kJointSpeed_rad_s, kJointSpeed_rad_s);
  Add(space, {"tool.x", "tool.y", "tool.z"}, "m", -kReach_m, kReach_m);
  Add(space, {"tool.qw"}, "1", 0.0, 1.0 + 1e-9);
  Add(space, {"tool.qx", "tool.qy", "tool.qz"}, "1", -1.0 - 1e-9, 1.0 + 1e-9);
  Add(space, {"raw.fx", "raw.fy", "raw.fz"}, "N", -kUnlimited, kUnlimited);
  Add(space, {"raw.tx", "raw.ty", "raw.tz"}, "Nm", -kUnlimited, kUnlimited);
  Add(space, {"filtered.fx", "filtered.fy", "filtered.fz"}, "N", -kUnlimited, kUnlimited);
  Add(space, {"filtered.tx", "filtered.ty", "filtered.tz"}, "Nm", -kUnlimited, kUnlimited);
  Add(space, {"contact"}, "1", 0.0, 1.0);
  Add(space, {"travelled"}, "m", -kUnlimited, kUnlimited);
  return space;
}

Eigen::Vector3d Three(std::span<const double> v, std::size_t at) { return {v[at], v[at + 1], v[at + 2]}; }

}  // namespace

namespace {

constexpr double kLeastLength = 1e-6;

bool Within(const SpaceComponent& c, double value) {
  return std::isfinite(value) && value >= c.low && value <= c.high && !(c.whole && value != std::floor(value));
}

double Length(std::span<const double> values, const Space::Direction& direction) {
  double sum = 0;
  for (const double value : values.subspan(direction.first, direction.count)) sum += value * value;
  return std::sqrt(sum);
}

}  // namespace

bool Space::Contains(std::span<const double> values) const {
  if (values.size() != components.size()) return false;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!Within(components[i], values[i])) return false;
  }
  return std::all_of(directions.begin(), directions.end(),
                     [&](const Direction& direction) { return Length(values, direction) >= kLeastLength; });
}

void Space::Require(std::span<const double> values) const {
  if (values.size() != components.size()) {
    throw InputError(name, fmt::format("{} numbers", values.size()), fmt::format("give {}", components.size()));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const SpaceComponent& c = components[i];
    if (Within(c, values[i])) continue;
    throw InputError(name, fmt::format("{} is {}", c.name, values[i]),
                     fmt::format("give {} to {} {}{}", c.low, c.high, c.unit, c.whole ? ", a whole number" : ""));
  }
  for (const Direction& direction : directions) {
    if (Length(values, direction) >= kLeastLength) continue;
    throw InputError(
        name,
        fmt::format("{} and what follows has length {}", components[direction.first].name, Length(values, direction)),
        "give a direction");
  }
}

std::string_view ToString(ActionKind kind) {
  switch (kind) {
    case ActionKind::kGuardedMove: return "guarded_move";
    case ActionKind::kTransfer: return "transfer";
    case ActionKind::kInsert: return "insert";
    case ActionKind::kLowLevel: return "low_level";
  }
  return "";
}

const Space& ObservationSpace() {
  static const Space space = MakeObservationSpace();
  return space;
}

void Flatten(const Observation& o, std::span<double> values) {
  if (values.size() != kObservationSize) {
    throw InputError("observation", fmt::format("room for {} numbers", values.size()),
                     fmt::format("give {}", kObservationSize));
  }
  Eigen::Quaterniond q(o.world_T_tool.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  Eigen::Map<Eigen::Matrix<double, kObservationSize, 1>>(values.data()) << o.q_rad, o.qd_rad_s,
      o.world_T_tool.translation(), q.w(), q.vec(), o.raw_wrench.force_n, o.raw_wrench.torque_nm,
      o.filtered_wrench.force_n, o.filtered_wrench.torque_nm, o.contact ? 1.0 : 0.0, o.travelled_m;
}

Space ActionSpace(ActionKind kind, const ActionBounds& bounds, double time_limit_s) {
  constexpr double kReach_m = 2.0;
  // Zero is no speed, force, way or time to act with.
  constexpr double kLeastSpeed_m_s = 1e-5;
  constexpr double kLeastForce_n = 1e-3;
  constexpr double kLeastDistance_m = 1e-6;
  constexpr double kLeastTime_s = 1e-3;
  Space space{std::string(ToString(kind)), {}, {}};
  switch (kind) {
    case ActionKind::kGuardedMove:
      Add(space, {"direction.x", "direction.y", "direction.z"}, "1", -1.0, 1.0);
      Add(space, {"distance"}, "m", 0.0, bounds.distance_m);
      Add(space, {"speed"}, "m/s", kLeastSpeed_m_s, bounds.speed_m_s);
      Add(space, {"contact_force"}, "N", kLeastForce_n, bounds.force_n);
      space.directions = {{0, 3}};
      break;
    case ActionKind::kTransfer:
      Add(space, {"x", "y", "z"}, "m", -kReach_m, kReach_m);
      Add(space, {"qw", "qx", "qy", "qz"}, "1", -1.0, 1.0);
      Add(space, {"straight"}, "1", 0.0, 1.0);
      Add(space, {"speed"}, "m/s", kLeastSpeed_m_s, bounds.speed_m_s);
      Add(space, {"contact_force"}, "N", kLeastForce_n, bounds.force_n);
      space.directions = {{3, 4}};
      break;
    case ActionKind::kInsert:
      Add(space, {"distance"}, "m", kLeastDistance_m, bounds.distance_m);
      Add(space, {"speed"}, "m/s", kLeastSpeed_m_s, bounds.speed_m_s);
      Add(space, {"force_limit"}, "N", kLeastForce_n, bounds.force_n);
      Add(space, {"time_limit"}, "s", kLeastTime_s, time_limit_s);
      break;
    case ActionKind::kLowLevel:
      Add(space, {"dx", "dy", "dz"}, "m", -bounds.delta_m, bounds.delta_m);
      Add(space, {"rx", "ry", "rz"}, "rad", -bounds.delta_rad, bounds.delta_rad);
      Add(space, {"steps"}, "1", 1.0, bounds.steps);
      space.components.back().whole = true;
      break;
  }
  return space;
}

Action DecodeAction(const Space& space, ActionKind kind, std::span<const double> v) {
  space.Require(v);
  switch (kind) {
    case ActionKind::kGuardedMove: {
      GuardedMoveAction action;
      action.motion.direction = Three(v, 0).normalized();
      action.motion.distance_m = v[3];
      action.motion.speed_m_s = v[4];
      action.motion.contact_force_n = v[5];
      return action;
    }
    case ActionKind::kTransfer: {
      const Eigen::Quaterniond q(v[3], v[4], v[5], v[6]);
      TransferAction action;
      action.world_T_tool = MakePose(Three(v, 0), q.normalized());
      action.straight = v[7] >= 0.5;
      action.speed_m_s = v[8];
      action.contact_force_n = v[9];
      return action;
    }
    case ActionKind::kInsert: {
      InsertAction action;
      action.distance_m = v[0];
      action.speed_m_s = v[1];
      action.force_limit_n = v[2];
      action.time_limit_s = v[3];
      return action;
    }
    case ActionKind::kLowLevel: break;
  }
  LowLevelAction action;
  action.delta << Three(v, 0), Three(v, 3);
  action.steps = static_cast<int>(v[6]);
  return action;
}

}  // namespace feeler::env
