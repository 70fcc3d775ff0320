#pragma once

#include <tinyxml2.h>

namespace feeler::env {

/// Adds what every scene has beside robot and task: sky, floor, lights, materials of the gripper, and a workbench (top
/// at z = 0, the only thing here that collides) where `workbench` is set. What the task file brings itself (a skybox
/// texture, a plane, a geom in the world named table, workbench or floor) is left alone.
void AddDecor(bool workbench, tinyxml2::XMLElement& mujoco);

}  // namespace feeler::env
