#pragma once

#include <Eigen/Core>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/pose.h"

namespace feeler::planner {

/// A straight motion of the tool, in a frame whose axes the tool is parallel to.
struct ToolMotion {
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();  ///< of the tool frame
  Direction direction = Direction::kMinusZ;
};

/// Where the tool meets a target of any pose: what a contact map is between its lattice points and orientations.
/// Implemented by the geometry of the task (planner/contact/exact_travel.h). One thread at a time.
class TravelModel {
 public:
  /// Travel of a motion that meets nothing, m.
  static constexpr double kUnlimited_m = 1e3;

  virtual ~TravelModel() = default;

  /// How far the tool travels in each of the motions until it touches a target at `frame_T_target`, metres. Negative
  /// for a motion that begins in the target: the way back to where it would have touched.
  virtual std::vector<double> Travel(const Pose& frame_T_target, const std::vector<ToolMotion>& motions) = 0;
};

}  // namespace feeler::planner
