#include "feeler/env/scene/episode_variation.h"

#include "feeler/core/random.h"

namespace feeler::env {
namespace {

double Draw(const Range& range, RandomStream& random) {
  return range.low < range.high ? random.Uniform(range.low, range.high) : range.low;
}

}  // namespace

EpisodeVariation DrawVariation(const Randomization& randomization, std::uint64_t seed, std::uint64_t episode) {
  const auto draw = [&](const RandomizationField& field) {
    RandomStream random(seed, episode, field.name);
    return Draw(randomization.*field.range, random);
  };
  EpisodeVariation variation;
  variation.physics.contact_friction = draw(kRandomizationFields[0]);
  variation.physics.clearance_m = draw(kRandomizationFields[1]);
  variation.yaw_rad = draw(kRandomizationFields[2]);
  variation.physics.tool_mass = draw(kRandomizationFields[3]);
  RandomStream bias(seed, episode, kRandomizationFields[4].name);
  for (double& force : variation.force_bias_n) force = Draw(randomization.force_bias_n, bias);
  return variation;
}

}  // namespace feeler::env
