#pragma once

#include <vector>

#include "feeler/core/random.h"
#include "feeler/env/robot/noise.h"

namespace feeler::env {

/// How a motion that is watched for contact goes where nothing stands in its way, in a world whose steps fail
/// (NoiseOptions::step_m): each step advances, or is spent while the tool stays, or ends the motion with a contact that
/// is none. What a step is (blocked or free) is the world's to say: those past a wall are never made.
struct WatchedWay {
  double length_m = 0.0;           ///< of all steps
  double step_m = 0.0;             ///< of each but the first, which may be shorter; 0: there are no steps
  double advance_m = 0.0;          ///< how far the tool comes
  bool false_contact = false;      ///< it ends with one
  std::vector<double> spent_at_m;  ///< how far the tool had come when each of the spent steps was made, ascending
  double spent_m = 0.0;            ///< what they come to
  /// The last of them were spent, and would have looked so far beyond `advance_m`: a step that is blocked reads, and is
  /// not spent.
  double look_m = 0.0;

  /// Steps that are left when the tool meets a wall after `advanced_m`, the one that reads it included: at least one.
  int StepsLeft(double advanced_m) const;
};

/// One draw. A first step of a share c of a step fails with probability 1 - (1 - p)^c. `false_stops` is drawn from once
/// where the noise has false contacts, `spent_steps` once a step where it has such.
WatchedWay DrawWatchedWay(const NoiseOptions& noise, double length_m, RandomStream& false_stops,
                          RandomStream& spent_steps);

}  // namespace feeler::env
