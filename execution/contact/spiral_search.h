#pragma once

#include <Eigen/Core>
#include <optional>

#include "feeler/core/task.h"
#include "feeler/execution/contact/mover.h"
#include "feeler/policies/policy.h"

namespace feeler::execution {

struct SpiralFind {
  /// Of the target (lattice coordinates), its mouth at the height of the face.
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  bool at_bottom = false;  ///< the tool came down right into the opening and stands at its bottom; else in the mouth
};

/// Presses the tool on the face around the opening, expected under `target` (lattice coordinates), and draws a spiral
/// from there until it drops in. Empty if it never drops; the tool is then off the face.
std::optional<SpiralFind> FindBySpiral(const Task& task, const Eigen::Vector3d& target,
                                       const policies::SpiralSearch& search, Mover& mover);

}  // namespace feeler::execution
