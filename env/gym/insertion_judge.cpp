#include "feeler/env/gym/insertion_judge.h"

#include "feeler/core/direction.h"

namespace feeler::env {

InsertionLimits LimitsOf(const Task& task) {
  InsertionLimits limits;
  limits.depth_tolerance_m = task.tolerance.vertical_m;
  limits.lateral_m = task.tolerance.lateral_m;
  return limits;
}

std::string_view ToString(InsertionReason reason) {
  switch (reason) {
    case InsertionReason::kInserted: return "inserted";
    case InsertionReason::kTooShallow: return "too shallow";
    case InsertionReason::kOffToTheSide: return "off to the side";
    case InsertionReason::kTilted: return "tilted";
    case InsertionReason::kTooMuchForce: return "too much force";
    case InsertionReason::kTooLate: return "too late";
  }
  return "";
}

InsertionVerdict JudgeInsertion(const Task& task, const InsertionLimits& limits, const Pose& world_T_tool,
                                const Pose& world_T_target, double peak_force_n, double time_s) {
  const Pose target_T_tool = world_T_target.inverse() * world_T_tool;
  const Eigen::Vector3d axis = UnitVector(task.insertion);
  const Eigen::Vector3d displacement_m = target_T_tool.translation();
  InsertionVerdict verdict;
  verdict.depth_m = displacement_m.dot(axis);
  verdict.lateral_m = (displacement_m - verdict.depth_m * axis).cwiseAbs().maxCoeff();
  verdict.angle_rad = InsertionAngle(task, target_T_tool.linear());
  // Negated comparisons, so that a pose that is not a number is never inserted.
  if (!(verdict.lateral_m <= limits.lateral_m)) {
    verdict.reason = InsertionReason::kOffToTheSide;
  } else if (!(verdict.depth_m >= task.insertion_depth_m - limits.depth_tolerance_m)) {
    verdict.reason = InsertionReason::kTooShallow;
  } else if (!(verdict.angle_rad <= limits.angle_rad)) {
    verdict.reason = InsertionReason::kTilted;
  } else if (!(peak_force_n <= limits.force_n)) {
    verdict.reason = InsertionReason::kTooMuchForce;
  } else if (!(time_s <= limits.time_s)) {
    verdict.reason = InsertionReason::kTooLate;
  } else {
    verdict.reason = InsertionReason::kInserted;
    verdict.inserted = true;
  }
  return verdict;
}

}  // namespace feeler::env
