#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {

/// Of a geom in its body.
Pose GeomPose(const mjModel& model, int geom);

/// Boxes around the lids of the target, in its axes: its openings, from mouth to bottom. Empty where the tool has them.
std::vector<Eigen::AlignedBox3d> TargetOpenings(const Scene& scene, const mjModel& model);

/// Whether the layer of a box geom behind one of its sides, `thickness_m` thick, outwards, reaches into an opening.
/// `side`: -1 or 1 along `axis` of the geom.
bool SideFacesOpening(const mjModel& model, int geom, int axis, int side, double thickness_m,
                      const std::vector<Eigen::AlignedBox3d>& openings);

/// Moves one side of a box geom outwards by `by_m` (negative: inwards).
void MoveSide(int geom, int axis, int side, double by_m, mjModel& model);

}  // namespace feeler::env
