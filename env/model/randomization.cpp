#include "feeler/env/model/randomization.h"

#include <fmt/format.h>

#include "feeler/core/error.h"

namespace feeler::env {

Randomization ReadRandomization(const mjModel& model, const std::string& where) {
  Randomization randomization;
  for (const RandomizationField& field : kRandomizationFields) {
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
  for (const RandomizationField& field : kRandomizationFields) {
    if (name == field.name) return true;
  }
  return false;
}

}  // namespace feeler::env
