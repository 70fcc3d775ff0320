#pragma once

#include <Eigen/Core>
#include <vector>

#include "feeler/env/model/task_file.h"

namespace feeler::env {

/// Points of the target's surface as a camera can see it, and its outward normals, in the frame of the target.
struct TargetPoints {
  std::vector<Eigen::Vector3d> points_m;
  std::vector<Eigen::Vector3d> normals;
};

/// Samples every geom of the target that is drawn (lids are not), in a grid of about `spacing_m`, leaving out what lies
/// inside another of its geoms. Same task and spacing, same points, in the same order.
/// Throws InputError for a geom that has no surface to sample (plane, height field) and for a spacing that is not
/// positive.
TargetPoints SampleTargetSurface(const TaskModel& task_model, double spacing_m);

}  // namespace feeler::env
