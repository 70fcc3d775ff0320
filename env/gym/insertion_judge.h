#pragma once

#include <string_view>

#include "feeler/core/pose.h"
#include "feeler/core/task.h"

namespace feeler::env {

/// Beyond which an insertion does not count.
struct InsertionLimits {
  double depth_tolerance_m = 0.001;  ///< may be missing to the task's insertion depth
  double lateral_m = 0.001;          ///< along each of the two axes across the insertion
  double angle_rad = 0.1;
  double force_n = 250.0;  ///< peak contact force on the tool in the episode; more breaks something
  double time_s = 120.0;   ///< since the reset
};

/// Depth and lateral limits from the task's tolerance: what the opening leaves is narrower still.
InsertionLimits LimitsOf(const Task& task);

enum class InsertionReason { kInserted, kTooShallow, kOffToTheSide, kTilted, kTooMuchForce, kTooLate };
/// "inserted", "too shallow", ...
std::string_view ToString(InsertionReason reason);

struct InsertionVerdict {
  bool inserted = false;
  InsertionReason reason = InsertionReason::kTooShallow;  ///< the first that applies, geometry before force and time
  double depth_m = 0.0;    ///< of the tool origin below the mouth, along the insertion direction
  double lateral_m = 0.0;  ///< the larger of the distances along the two axes across the insertion
  double angle_rad = 0.0;  ///< between the frames, or between their insertion axes where the parts turn freely
};

/// Decides from the truth alone; what the executor believes plays no part.
InsertionVerdict JudgeInsertion(const Task& task, const InsertionLimits& limits, const Pose& world_T_tool,
                                const Pose& world_T_target, double peak_force_n, double time_s);

}  // namespace feeler::env
