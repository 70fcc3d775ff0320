#pragma once

#include <string>

#include "feeler/core/task.h"
#include "feeler/env/gym/insertion_env.h"

namespace feeler::evaluation {

/// What an episode is worth. Everything here is measured on the world; nothing rests on what a policy, an executor or a
/// user of the robot claims. Quantities that are no number count as the worst.
struct EpisodeScore {
  /// Inserted to depth in the right port, within tolerance, force and time limits (env::JudgeInsertion).
  bool success = false;
  std::string reason;          ///< "inserted", "too shallow", ...
  double partial_depth = 0.0;  ///< 0..1: share of the insertion depth; 0 beside the opening, whatever the depth
  double lateral_m = 0.0;      ///< of the tool beside the axis of the opening
  double peak_force_n = 0.0;
  double impulse_ns = 0.0;  ///< time integral of the contact force
  int forbidden_contacts = 0;
  double path_length_m = 0.0;
  double sim_time_s = 0.0;
};

/// The score of the present instant, e.g. when a user of `environment.robot()` is done.
EpisodeScore ScoreOf(const env::InsertionEnv& environment);

/// Share of the insertion depth that was reached in the opening.
double PartialDepth(const Task& task, const env::InsertionLimits& limits, double depth_m, double lateral_m);

}  // namespace feeler::evaluation
