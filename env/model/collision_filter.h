#pragma once

#include <mujoco/mujoco.h>

namespace feeler::env {

/// Whether two geoms are certainly farther apart than their margins: bounding spheres, then the face normals of their
/// bounding boxes as separating axes (Gottschalk, Lin and Manocha 1996). Kinematics in `data` must be up to date.
/// Never true for geoms in contact; false where it cannot tell.
bool SurelyApart(const mjModel& model, const mjData& data, int geom1, int geom2);

/// Makes MuJoCo skip pairs of geoms that are surely apart, in every model of the process: the contacts are the same,
/// bit for bit, and found several times faster. MuJoCo by itself prunes by bounding spheres only, and the sphere around
/// a table or a panel meets everything. Idempotent and thread-safe.
void InstallCollisionFilter();

}  // namespace feeler::env
