#pragma once

#include <urdf_model/model.h>
#include <urdf_world/types.h>

#include <string>

namespace feeler::planner {

/// Reads a URDF file. Throws InputError (file, what, how to mend) where it cannot be read or is no robot.
urdf::ModelInterfaceSharedPtr ReadRobotDescription(const std::string& file);

}  // namespace feeler::planner
