#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "feeler/env/model/randomization.h"
#include "feeler/env/scene/physics_variation.h"

namespace feeler::env {

/// What differs in one episode of a randomized task.
struct EpisodeVariation {
  PhysicsVariation physics;
  double yaw_rad = 0.0;                                    ///< the target turned about the insertion axis
  Eigen::Vector3d force_bias_n = Eigen::Vector3d::Zero();  ///< of the force sensor
};

/// One draw, the same for the same key. Every range has a stream of its own, so that adding one leaves the others.
EpisodeVariation DrawVariation(const Randomization& randomization, std::uint64_t seed, std::uint64_t episode);

}  // namespace feeler::env
