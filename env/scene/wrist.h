#pragma once

#include <mujoco/mujoco.h>
#include <tinyxml2.h>

#include "feeler/core/task.h"
#include "feeler/env/scene/scene.h"

namespace feeler::env {

/// Throws InputError for a stiffness out of range, `scene options` being where.
void RequireWrist(const SceneOptions& options);

/// Gives the body of the tool (of this mass) its slides; nothing where the options have no wrist. Throws InputError
/// where the springs are stiffer than the time step bears.
void AddWrist(const SceneOptions& options, const Task& task, double tool_mass_kg, tinyxml2::XMLElement& tool);

/// Where the slides are in the compiled model.
Wrist FindWrist(const SceneOptions& options, const mjModel& model);

}  // namespace feeler::env
