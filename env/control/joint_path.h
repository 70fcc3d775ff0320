#pragma once

#include <vector>

#include "env/control/joint_control.h"
#include "env/control/trajectory.h"

namespace feeler::env {

/// What the joints may do in transfers.
struct JointLimits {
  JointVector velocity_rad_s = JointVector::Constant(2.0);
  JointVector acceleration_rad_s2 = JointVector::Constant(5.0);
};

/// Joint-space way points joined by straight segments, each from rest to rest in the shortest time that every joint's
/// limits allow; so the arm passes exactly through what the planner has checked.
class JointPathTrajectory {
 public:
  /// `way_points`: at least one.
  JointPathTrajectory(std::vector<JointVector> way_points, const JointLimits& limits);
  double duration_s() const { return start_s_.back(); }
  JointReference At(double time_s) const;

 private:
  std::vector<JointVector> way_points_;
  std::vector<TrapezoidalProfile> segments_;  ///< of the fraction of each segment
  std::vector<double> start_s_;               ///< per way point
};

}  // namespace feeler::env
