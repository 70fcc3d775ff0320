#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/env/robot/noise.h"

namespace feeler::workflow {

/// A value drawn uniformly per episode.
struct FaultRange {
  double least = 0.0;
  double most = 0.0;
};

/// What makes the world of an episode harder than the planner thinks it is.
struct EpisodeFaults {
  std::string name = "ideal";  ///< as records give it
  env::NoiseOptions robot;     ///< arm and force sensor
  /// The truth lies outside the hypotheses: beyond the box of possible positions on one axis.
  bool outside = false;
  double outside_least_m = 0.0005;  ///< drawn uniformly from here
  double outside_most_m = 0.004;    ///< to here
  /// The truth lies so that a probe of the policy comes down into the opening.
  bool fall_in = false;
  double oversize_m = 0.0;  ///< the sides of the target stand this much farther out in physics than in the model
  /// The target is turned by so much about the insertion axis, the sign drawn; where `least` is smaller, so is the turn
  /// (uniform between the two).
  double yaw_error_rad = 0.0;
  double yaw_error_least_rad = 0.0;
  std::optional<FaultRange> force_noise_n;     ///< the threshold of contact is that of the most
  std::optional<FaultRange> latency_s;         ///< of the force sensor
  std::optional<FaultRange> contact_friction;  ///< coefficient of every contact
  /// The tool has slipped in the gripper, in any direction across the insertion, and turned by 2 degrees about it for
  /// every mm, either way.
  std::optional<FaultRange> slip_m;
  double false_stop = 0.0;      ///< probability, a cell, that a watched motion ends with a contact that is none
  double missed_contact = 0.0;  ///< probability, a cell that is blocked, that such a motion reports no contact there
  double spent_step = 0.0;      ///< probability, a cell that is free, that such a motion spends it while the tool stays
  std::optional<FaultRange> port_stiffness_n_m;  ///< of the springs that the target stands on
  std::optional<FaultRange> worn_m;              ///< the lead-in is larger by this; negative: smaller
};

struct FaultName {
  std::string name;
  std::string meaning;
};
/// Every name that ParseFaults takes, with a line about each.
std::vector<FaultName> FaultNames();

/// One name or several with commas between ("friction,yaw-2", "force-noise=2,yaw=1.5", "yaw=0..5,outside=0.3..7"): at
/// most one of the arm, the rest add up. A..B is drawn per episode from its seed. Throws InputError for an unknown
/// name, listing the known ones, and for names that contradict each other.
EpisodeFaults ParseFaults(std::string_view text);

}  // namespace feeler::workflow
