#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/task.h"
#include "execution/mover.h"

namespace feeler::execution {

struct SpiralOptions {
  double radius_m = 0.0045;
  double pitch_m = 0.0015;
  double speed_m_s = 0.02;
  double press_n = 10.0;  ///< of the tool on the face around the opening
};

/// Presses the tool on the face around the opening, expected under `target` (lattice coordinates), and draws a spiral
/// from there until it drops in. Returns the position of the target that this shows (its mouth at the height of the
/// face); the tool is then in the mouth. Empty if it never drops; the tool is then off the face.
std::optional<Eigen::Vector3d> SpiralSearch(const Task& task, const Eigen::Vector3d& target,
                                            const SpiralOptions& options, Mover& mover);

}  // namespace feeler::execution
