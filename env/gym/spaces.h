#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "feeler/env/gym/insertion_env.h"

namespace feeler::env {

/// One number of an observation or an action.
struct SpaceComponent {
  std::string name;  ///< "tool.x", ...
  std::string unit;  ///< "m", "rad", "N", ...; "1" for a pure number
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool whole = false;  ///< whole numbers only
};

/// A box of real vectors, every component described: Gymnasium's `Box`.
struct Space {
  std::string name;
  std::vector<SpaceComponent> components;
  /// Components first .. first + count - 1 are a direction or a quaternion, whose length does not count: at least 1e-6.
  struct Direction {
    std::size_t first = 0;
    std::size_t count = 0;
  };
  std::vector<Direction> directions;
  int size() const { return static_cast<int>(components.size()); }
  /// Of the right length, finite, within the bounds, whole where that is asked, and no direction of length zero.
  bool Contains(std::span<const double> values) const;
  /// Throws InputError naming the component that is out of bounds or not finite, or the length that is wrong.
  void Require(std::span<const double> values) const;
};

/// The four kinds of action; the order of std::variant in `Action`.
enum class ActionKind { kGuardedMove, kTransfer, kInsert, kLowLevel };
/// "guarded_move", ...
std::string_view ToString(ActionKind kind);

/// Numbers of an observation: q (6), qd (6), tool position (3) and quaternion w x y z (4, w >= 0), raw wrench (force,
/// torque), filtered wrench, contact (0 or 1), travelled.
inline constexpr int kObservationSize = 33;

/// Every observation lies in it.
const Space& ObservationSpace();
/// `observation` as numbers, in the order of the space. `values`: kObservationSize.
void Flatten(const Observation& observation, std::span<double> values);

/// The actions of one kind as vectors:
///   guarded_move: direction x y z (of any length but zero, world axes), distance, speed, contact force;
///   transfer: position x y z, quaternion w x y z (of any length but zero), straight (0.5 or more: yes), speed and
///   contact force if straight; insert: distance, speed, force limit, time limit; low_level: displacement x y z,
///   rotation vector x y z (world axes), physics steps (a whole number).
/// InsertionEnv::Step accepts whatever lies in the space of its bounds and time limit.
Space ActionSpace(ActionKind kind, const ActionBounds& bounds = {}, double time_limit_s = 120.0);

/// The action that the numbers say. Throws InputError where they do not lie in the space of that kind.
Action DecodeAction(const Space& space, ActionKind kind, std::span<const double> values);

}  // namespace feeler::env
