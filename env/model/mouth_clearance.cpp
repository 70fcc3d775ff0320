#include "feeler/env/model/mouth_clearance.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "feeler/core/direction.h"
#include "feeler/env/model/geom_shapes.h"

namespace feeler::env {
namespace {

/// Nothing farther than this is a wall of an opening.
constexpr double kFar_m = 0.02;

double JustInside(const Task& task) { return std::min(5e-5, task.insertion_depth_m / 10); }

/// The largest of 0 to `most` that is fine, where less than what is fine is fine, too.
double Largest(double most, const std::function<bool(double)>& fine) {
  double fits = 0.0;
  double misses = most;
  if (!fine(0.0)) return 0.0;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (fits + misses);
    (fine(middle) ? fits : misses) = middle;
  }
  return fits;
}

}  // namespace

std::array<std::array<double, 2>, 3> ClearanceAtMouth(const TaskModel& task_model) {
  const Task& task = task_model.task;
  OverlapJudge open(task_model, task_model.target_geoms);
  std::array<std::array<double, 2>, 3> clearance;
  for (auto& sides : clearance) sides.fill(std::numeric_limits<double>::infinity());
  const Eigen::Vector3d mouth_m = UnitVector(task.insertion) * JustInside(task);
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == AxisOf(task.insertion)) continue;
    for (int side = 0; side < 2; ++side) {
      const Eigen::Vector3d way = Eigen::Vector3d::Unit(axis) * (side == 0 ? -1 : 1);
      double free_m = 0;
      double step_m = 1e-5;
      while (step_m <= kFar_m && !open.Overlap(mouth_m + way * step_m)) {
        free_m = step_m;
        step_m *= 1.5;
      }
      if (step_m > kFar_m) continue;
      for (int i = 0; i < 30; ++i) {
        const double middle_m = 0.5 * (free_m + step_m);
        (open.Overlap(mouth_m + way * middle_m) ? step_m : free_m) = middle_m;
      }
      clearance[static_cast<std::size_t>(axis)][static_cast<std::size_t>(side)] = free_m;
    }
  }
  return clearance;
}

bool EntersDisplaced(OverlapJudge& judge, const Task& task, const Eigen::Vector3d& lateral_m) {
  const int axis = AxisOf(task.insertion);
  for (int k = 0; k < 9; ++k) {
    Eigen::Vector3d place_m = UnitVector(task.insertion) * JustInside(task);
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    place_m[u] += lateral_m[u] * (k % 3 - 1);
    place_m[v] += lateral_m[v] * (k / 3 - 1);
    if (judge.Overlap(place_m)) return false;
  }
  return true;
}

double LargestLateralOnBoth(const TaskModel& task_model) {
  OverlapJudge open(task_model, task_model.target_geoms);
  return Largest(kFar_m, [&](double lateral_m) {
    return EntersDisplaced(open, task_model.task, Eigen::Vector3d::Constant(lateral_m));
  });
}

Eigen::Vector3d LargestLateralTolerance(const TaskModel& task_model) {
  const Task& task = task_model.task;
  OverlapJudge open(task_model, task_model.target_geoms);
  Eigen::Vector3d alone_m = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == AxisOf(task.insertion)) continue;
    alone_m[axis] = Largest(
        kFar_m, [&](double lateral_m) { return EntersDisplaced(open, task, lateral_m * Eigen::Vector3d::Unit(axis)); });
  }
  return alone_m * Largest(1.0, [&](double share) { return EntersDisplaced(open, task, share * alone_m); });
}

void DeriveTolerances(TaskModel& task_model) {
  Task& task = task_model.task;
  const int along = AxisOf(task.insertion);
  if (std::isnan(task.tolerance.lateral_m)) {
    const Eigen::Vector3d largest_m = LargestLateralTolerance(task_model);
    // Rounded down, so that what is written down is what enters.
    SetLateral(task.tolerance, task.insertion, (largest_m.array() * 1e7).floor() * 1e-7);
  }
  if (!std::isnan(task.tolerance.angle_rad)) return;
  constexpr double kLeast_rad = 0.01;
  constexpr double kMost_rad = 0.05;
  const auto clearance_m = ClearanceAtMouth(task_model);
  const auto play_m = [&](int axis) {
    const auto& sides = clearance_m[static_cast<std::size_t>(axis)];
    return sides[0] + sides[1];
  };
  Eigen::Vector3d angle_rad;
  double rim_m = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == along) continue;
    angle_rad[axis] = play_m(3 - along - axis) / task.insertion_depth_m;
    const auto span =
        SpanOf(*task_model.model, task_model.tool_geoms, task_model.tool_body, Eigen::Vector3d::Unit(axis));
    rim_m = std::max(rim_m, 0.5 * (span[1] - span[0]));
  }
  angle_rad[along] = 0.5 * std::min(play_m((along + 1) % 3), play_m((along + 2) % 3)) / std::max(rim_m, 1e-6);
  SetAngles(task.tolerance, angle_rad.cwiseMax(kLeast_rad).cwiseMin(kMost_rad));
}

}  // namespace feeler::env
