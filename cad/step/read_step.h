#pragma once

#include <filesystem>

#include "feeler/cad/readers/read_part.h"

namespace feeler::cad {

/// The solids of a STEP file as triangles, in millimetres, each with its place in the assembly and its name: a surface
/// is met within `deflection_mm`, an arc within `angle_rad`. Solids that are used several times come several times.
/// Throws InputError for a file that Open CASCADE cannot read, or dies of (it reads in a process of its own), or that
/// holds no solid; Interrupted.
RawPart ReadStep(const std::filesystem::path& file, double deflection_mm = 0.002, double angle_rad = 0.1);

}  // namespace feeler::cad
