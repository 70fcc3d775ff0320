#pragma once

#include <tinyxml2.h>

#include <string>

namespace feeler::env {

/// Throws InputError, naming file, element, attribute and line, for a number of an MJCF text that is NaN, infinite or
/// beyond what a double holds: MuJoCo takes them, and the simulation goes wrong later.
void RequireFiniteNumbers(const tinyxml2::XMLElement& root, const std::string& where);

}  // namespace feeler::env
