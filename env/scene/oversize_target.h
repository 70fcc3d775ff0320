#pragma once

#include "feeler/env/scene/scene.h"

namespace feeler::env {

/// The scene with a target whose sides stand `oversize_m` farther out, as a part that was moulded too large: the faces
/// of its box geoms that look across the insertion axis and away from the opening (its lids). Planner and contact map
/// know nothing of it. Throws InputError when the target has no such face or the size is not a number of at least zero.
Scene WithOversizeTarget(const Scene& scene, double oversize_m);

}  // namespace feeler::env
