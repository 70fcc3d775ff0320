#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/gym/spaces.h"

/// What the Gymnasium environments make of numbers: flat normalised actions, bounded observations, rewards. Used by the
/// single environment and by the vector alike, so that the two are the same bit for bit.
namespace feeler::python {

/// How an action is written as numbers.
enum class ActionFormat : std::uint8_t {
  kControl,        ///< 6 numbers in [-1, 1]: displacement and turn of the set point, in shares of the largest
  kMacro,          ///< 8 numbers in [-1, 1]: which of the three macro actions, and its numbers
  kMacroDiscrete,  ///< 3 whole numbers: verb, length, speed
};
ActionFormat ParseFormat(std::string_view name);

struct CodecOptions {
  ActionFormat format = ActionFormat::kControl;
  int control_steps = 20;             ///< ms of physics an action
  double max_displacement_m = 0.002;  ///< an action, as a whole: longer ones are shortened
  double max_turn_rad = 0.01;
  double reward_progress = 0.0;  ///< per metre that the tool comes nearer to where it is inserted, by the truth
  /// Throws InputError.
  void Validate(const env::ActionBounds& bounds) const;
};

/// Sizes of the discrete format: directions of guarded moves in the axes of the estimate, "back to the start",
/// "insert"; lengths in cells; speeds.
inline constexpr int kVerbs = 8;
inline constexpr int kDiscreteLengths[] = {1, 2, 4, 8, 16};
inline constexpr double kDiscreteSpeeds_m_s[] = {0.005, 0.02, 0.05};

int SizeOf(ActionFormat format);

/// The action that the numbers stand for in this environment. Throws InputError for another number of them, what is not
/// finite, and what is out of the space.
env::Action Decode(const CodecOptions& options, std::span<const double> values, const env::InsertionEnv& environment);

/// Low and high of each of the numbers of an observation, all finite: what is unlimited in the library gets the range
/// of the sensor.
const std::vector<double>& ObservationLow();
const std::vector<double>& ObservationHigh();
/// Readings beyond the range of the sensor stay at its end.
void Saturate(std::span<double> observation);

/// Distance of the tool, as observed, from where it stands inserted in the target.
double DistanceToGoal(const env::InsertionEnv& environment, std::span<const double> observation,
                      const Pose& world_T_target);

}  // namespace feeler::python
