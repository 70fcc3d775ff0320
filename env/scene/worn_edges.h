#pragma once

#include <mujoco/mujoco.h>

#include "feeler/env/scene/scene.h"

namespace feeler::env {

/// Makes the lead-in of the target's opening larger by `worn_m` (edges worn by use; negative: smaller, as of a part
/// that was moulded too tight), in a copy of the scene's model. The slanted faces around the mouth are moved parallel
/// to themselves, so that the lead-in reaches deeper by `worn_m`, and as much farther out as its slope says; boxes that
/// stand around the opening recede with it. Where the opening is at the bottom of its lead-in it stays as it is.
///
/// Throws InputError where the target has no lead-in made of meshes, or one that is not `worn_m` deep.
void WearEdges(const Scene& scene, double worn_m, mjModel& model);

}  // namespace feeler::env
