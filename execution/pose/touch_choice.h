#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/execution/pose/pose_fit.h"
#include "feeler/planner/contact/travel_model.h"

namespace feeler::execution {

/// A pose that the target may have, and how likely it is (any positive scale).
struct PoseCandidate {
  PoseVector pose = PoseVector::Zero();
  double weight = 1.0;
};

/// Where the tool may go while it touches, metres, axes of the lattice frame.
struct TouchSpace {
  Eigen::Vector3d lower_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper_m = Eigen::Vector3d::Zero();
  Direction insertion = Direction::kMinusZ;
  double clear_m = 0.0;  ///< coordinate along the insertion axis at which every place across is free
};

/// A touch that tells candidates apart: from the clear height over `motion.from_m` straight to it, then the probe.
struct TouchPlan {
  planner::ToolMotion motion;
  double nearest_m = 0.0;   ///< least travel under a candidate
  double farthest_m = 0.0;  ///< greatest, at most the end of the space
  double gain = 0.0;        ///< expected reduction of the variance, in units of the scales, per second
};

struct TouchChoiceOptions {
  int probes = 60;              ///< looked at for one touch
  double noise_m = 1.5e-4;      ///< of a reading
  double clearance_m = 2.5e-3;  ///< kept from every candidate on the way to the probe
  /// What an error of the pose weighs: one over the error that an insertion forgives, x y z yaw pitch.
  PoseVector scale = (PoseVector() << 1e-3, 1e-3, 1e-3, 0.1, 0.02).finished();
  double transfer_speed_m_s = 0.2;
  double probe_speed_m_s = 0.05;
};

/// The touch, among some drawn at random (keyed by `draw`), whose reading is expected to tell most about the pose for
/// its time: for jointly normal pose and reading the variance of axis a falls by cov(a, reading)^2 / (var(reading) +
/// noise^2). Touches near an edge, where a small error of the place across makes a large one of the reading, are left
/// out. Empty: no touch tells the candidates apart.
std::optional<TouchPlan> ChooseTouch(planner::TravelModel& model, const std::vector<PoseCandidate>& candidates,
                                     const TouchSpace& space, const Eigen::Vector3d& tool_m, std::uint64_t draw,
                                     const TouchChoiceOptions& options = {});

}  // namespace feeler::execution
