#pragma once

#include <vector>

#include "feeler/core/pose.h"
#include "feeler/env/arm/ur10e.h"
#include "feeler/env/scene/world.h"

namespace feeler::workflow {

/// The strongest contact of the tool during a sample.
struct ReplayContact {
  int sample = 0;  ///< index into Replay::q_rad
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  double force_n = 0.0;
};

/// What an episode looked like: enough to draw it again. A pure function of the episode.
struct Replay {
  double period_s = 0.05;
  double start_s = 0.0;                 ///< when the arm had arrived at the start pose
  std::vector<env::JointVector> q_rad;  ///< true joint positions at 0, period_s, 2 * period_s, ...
  std::vector<ReplayContact> contacts;  ///< in order of sample
};

/// Writes a replay while physics runs; to be shown the world after every step.
class ReplayRecorder {
 public:
  explicit ReplayRecorder(const env::Scene& scene) : scene_(scene) {}

  void See(const env::World& world);
  /// The arm has arrived at the start pose.
  void MarkStart(double time_s) { replay_.start_s = time_s; }
  /// The replay so far, with the present state as its last sample.
  Replay Take(const env::World& world);

 private:
  bool Touches(const env::ContactForce& contact) const;

  const env::Scene& scene_;
  Replay replay_;
};

}  // namespace feeler::workflow
