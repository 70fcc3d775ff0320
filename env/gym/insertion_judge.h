#pragma once

#include <array>
#include <string_view>

#include "feeler/core/pose.h"
#include "feeler/core/task.h"
#include "feeler/env/model/task_pieces.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {

/// Beyond which an insertion does not count.
struct InsertionLimits {
  double depth_tolerance_m = 0.001;  ///< may be missing to the task's insertion depth
  /// Per axis of the target frame, of which the two across the insertion count, towards sides where no wall of the
  /// opening holds the tool.
  Eigen::Vector3d lateral_m = Eigen::Vector3d::Constant(0.001);
  /// Per axis of the target frame, towards its negative and its positive side: how far the tool may stand from the
  /// middle where a wall of the opening holds it, the give of the contact included. 0: no wall, lateral_m counts.
  std::array<std::array<double, 2>, 3> walls_m{};

  /// True if a displacement (target frame, m) lies inside the opening on both axes across the insertion.
  bool InsideOpening(const Task& task, const Eigen::Vector3d& displacement_m) const;
  double angle_rad = 0.1;
  double force_n = 250.0;  ///< peak contact force on the tool in the episode; more breaks something
  double time_s = 120.0;   ///< since the reset
};

/// Depth and lateral limits from the task's tolerance alone, for a task without geometry.
InsertionLimits LimitsOf(const Task& task);
/// The same with the walls of the opening measured: from the inserted pose, as little deep as counts, the tool goes to
/// each side until it touches. What it meets there holds it; farther than that it cannot be inside. Pieces: with the
/// opening open.
InsertionLimits LimitsOf(const Task& task, const TaskPieces& pieces);
/// From the geoms of a scene as physics has them.
InsertionLimits LimitsOf(const Scene& scene);

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
