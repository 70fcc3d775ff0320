#include "feeler/env/gym/insertion_judge.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/env/model/geom_shapes.h"
#include "feeler/planner/contact/exact_travel.h"

namespace feeler::env {
namespace {

/// What a wall yields to a tool that is pressed against it: with the shipped contact parameters some hundredths of a
/// millimetre at the force limit of an insertion.
constexpr double kGive_m = 1e-4;
/// A wall farther from the tool than this, or than four times the lateral tolerance, does not hold it.
constexpr double kFarWall_m = 1e-3;

}  // namespace

InsertionLimits LimitsOf(const Task& task) {
  InsertionLimits limits;
  limits.depth_tolerance_m = task.tolerance.vertical_m;
  for (int axis = 0; axis < 3; ++axis) limits.lateral_m[axis] = task.tolerance.Lateral(axis);
  return limits;
}

InsertionLimits LimitsOf(const Task& task, const TaskPieces& pieces) {
  InsertionLimits limits = LimitsOf(task);
  planner::ExactTravel travel(pieces.tool, pieces.target);
  const Eigen::Vector3d inserted_m =
      UnitVector(task.insertion) *
      std::max(0.5 * task.insertion_depth_m, task.insertion_depth_m - limits.depth_tolerance_m);
  std::vector<planner::ToolMotion> motions;
  for (const Direction direction : kDirections) {
    if (AxisOf(direction) != AxisOf(task.insertion)) motions.push_back({inserted_m, direction});
  }
  const std::vector<double> room_m = travel.Travel(Pose::Identity(), motions);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const Direction direction = motions[i].direction;
    const double far_m = std::max(kFarWall_m, 4.0 * limits.lateral_m[AxisOf(direction)]);
    if (room_m[i] < 0.0 || room_m[i] > far_m) continue;
    limits.walls_m[static_cast<std::size_t>(AxisOf(direction))][SignOf(direction) > 0 ? 1 : 0] = room_m[i] + kGive_m;
  }
  return limits;
}

InsertionLimits LimitsOf(const Scene& scene) {
  const mjModel& model = *scene.model;
  TaskPieces pieces;
  for (const int geom : scene.tool_geoms) {
    pieces.tool.push_back(PieceOf(model, geom, GeomInBody(model, geom, scene.tool_body)));
  }
  for (const int geom : scene.target_geoms) {
    if (model.geom_type[geom] == mjGEOM_PLANE) continue;
    pieces.target.push_back(PieceOf(model, geom, GeomInBody(model, geom, scene.target_body)));
  }
  return LimitsOf(scene.task, pieces);
}

bool InsertionLimits::InsideOpening(const Task& task, const Eigen::Vector3d& displacement_m) const {
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == AxisOf(task.insertion)) continue;
    const double wall_m = walls_m[static_cast<std::size_t>(axis)][displacement_m[axis] > 0.0 ? 1 : 0];
    // Negated, so that what is not a number is not inside.
    if (!(std::abs(displacement_m[axis]) <= (wall_m > 0.0 ? wall_m : lateral_m[axis]))) return false;
  }
  return true;
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
  if (!limits.InsideOpening(task, displacement_m)) {
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
