#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>

namespace feeler::env {

/// The part of a scene that physics needs: without the geoms that are only seen, and without textures. Bodies, joints,
/// actuators, masses and everything that can touch stay as they are, so states of the two models are interchangeable;
/// what is seen is two thirds of the geoms, which MuJoCo moves and tests for collision at every step all the same.
///
/// `full` is the compiled `xml`. Lids (group `lid_group`) stay. Where the text does not allow to tell what is what
/// (composites, explicit pairs), the result is `full` itself.
std::shared_ptr<const mjModel> CompilePhysicsModel(const std::string& xml, std::shared_ptr<const mjModel> full,
                                                   int lid_group, const std::string& where);

}  // namespace feeler::env
