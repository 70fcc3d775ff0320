#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <string>
#include <string_view>

namespace feeler::env {

/// A range of values; a draw is uniform in it.
struct Range {
  double low = 0.0;
  double high = 0.0;
};

/// What differs from episode to episode, as the task file gives it (`feeler_random_*`). The default: nothing.
struct Randomization {
  Range contact_friction{1.0, 1.0};  ///< factor on the sliding friction of all contacts
  Range clearance_m;                 ///< added on each side of the tool across the insertion; negative: a tighter fit
  Range yaw_rad;                     ///< error of the target's orientation about the insertion axis
  Range tool_mass{1.0, 1.0};         ///< factor on mass and inertia of the tool
  Range force_bias_n;                ///< of the force sensor, per axis
};

/// A field of a task file that holds a range.
struct RandomizationField {
  const char* name;
  Range Randomization::*range;
  double low, high;  ///< what a range may span
};
inline constexpr std::array<RandomizationField, 5> kRandomizationFields = {{
    {"feeler_random_friction", &Randomization::contact_friction, 0.0, 10.0},
    {"feeler_random_clearance", &Randomization::clearance_m, -0.01, 0.01},
    {"feeler_random_yaw", &Randomization::yaw_rad, -0.5, 0.5},
    {"feeler_random_tool_mass", &Randomization::tool_mass, 0.1, 10.0},
    {"feeler_random_force_bias", &Randomization::force_bias_n, -100.0, 100.0},
}};

/// Reads `feeler_random_*` (docs/task-file.md); absent: no randomization. Throws InputError naming `where` and the
/// field whose range is malformed.
Randomization ReadRandomization(const mjModel& model, const std::string& where);

/// Whether it is the name of such a field.
bool IsRandomizationField(std::string_view name);

}  // namespace feeler::env
