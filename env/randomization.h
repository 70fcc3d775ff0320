#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

#include "env/physics_variation.h"

namespace feeler::env {

/// What differs in one episode of a randomized task.
struct EpisodeVariation {
  PhysicsVariation physics;
  double yaw_rad = 0.0;                                    ///< the target turned about the insertion axis
  Eigen::Vector3d force_bias_n = Eigen::Vector3d::Zero();  ///< of the force sensor
};

/// One draw, the same for the same key. Every range has a stream of its own, so that adding one leaves the others.
EpisodeVariation DrawVariation(const Randomization& randomization, std::uint64_t seed, std::uint64_t episode);

/// Reads `feeler_random_*` (docs/task-file.md); absent: no randomization. Throws InputError naming `where` and the
/// field whose range is malformed.
Randomization ReadRandomization(const mjModel& model, const std::string& where);

/// Whether it is the name of such a field.
bool IsRandomizationField(std::string_view name);

}  // namespace feeler::env
