#include "env/randomization.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/error.h"
#include "core/random.h"

namespace feeler::env {
namespace {

struct Field {
  const char* name;
  Range Randomization::*range;
  double low, high;  ///< what a range may span
};
constexpr std::array<Field, 5> kFields = {{
    {"feeler_random_friction", &Randomization::contact_friction, 0.0, 10.0},
    {"feeler_random_clearance", &Randomization::clearance_m, -0.01, 0.01},
    {"feeler_random_yaw", &Randomization::yaw_rad, -0.5, 0.5},
    {"feeler_random_tool_mass", &Randomization::tool_mass, 0.1, 10.0},
    {"feeler_random_force_bias", &Randomization::force_bias_n, -100.0, 100.0},
}};

double Draw(const Range& range, RandomStream& random) {
  return range.low < range.high ? random.Uniform(range.low, range.high) : range.low;
}

}  // namespace

EpisodeVariation DrawVariation(const Randomization& randomization, std::uint64_t seed, std::uint64_t episode) {
  const auto draw = [&](const Field& field) {
    RandomStream random(seed, episode, field.name);
    return Draw(randomization.*field.range, random);
  };
  EpisodeVariation variation;
  variation.physics.contact_friction = draw(kFields[0]);
  variation.physics.clearance_m = draw(kFields[1]);
  variation.yaw_rad = draw(kFields[2]);
  variation.physics.tool_mass = draw(kFields[3]);
  RandomStream bias(seed, episode, kFields[4].name);
  for (double& force : variation.force_bias_n) force = Draw(randomization.force_bias_n, bias);
  return variation;
}

Randomization ReadRandomization(const mjModel& model, const std::string& where) {
  Randomization randomization;
  for (const Field& field : kFields) {
    const int id = mj_name2id(&model, mjOBJ_NUMERIC, field.name);
    if (id < 0) continue;
    const auto fail = [&](const std::string& what) {
      throw InputError(fmt::format("{}: <custom><numeric name=\"{}\">", where, field.name), what,
                       "give the lowest and the highest value, in this order; see docs/task-file.md");
    };
    if (model.numeric_size[id] != 2) fail(fmt::format("has {} values instead of 2", model.numeric_size[id]));
    const mjtNum* data = model.numeric_data + model.numeric_adr[id];
    if (!(data[0] <= data[1])) fail(fmt::format("{} is above {}", data[0], data[1]));
    if (!(data[0] >= field.low && data[1] <= field.high)) {
      fail(fmt::format("{} to {} is not within {} to {}", data[0], data[1], field.low, field.high));
    }
    randomization.*field.range = {data[0], data[1]};
  }
  return randomization;
}

bool IsRandomizationField(std::string_view name) {
  for (const Field& field : kFields) {
    if (name == field.name) return true;
  }
  return false;
}

}  // namespace feeler::env
