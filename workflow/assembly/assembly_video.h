#pragma once

#include <string>

#include "feeler/core/progress.h"
#include "feeler/env/vision/image.h"
#include "feeler/workflow/assembly/assembly_build.h"

namespace feeler::workflow {

/// An MP4 of a build, 25 frames a second, one for each frame of the film: the cell, and the part in the gripper from
/// near in a corner. Throws InputError if the file cannot be written or the machine cannot render or encode.
void WriteAssemblyVideo(const Assembly& assembly, const AssemblyFilm& film, const AssemblyRecord& record,
                        const std::string& path, const ProgressCallback& progress);

/// A picture of the structure as drawn, all parts in place.
env::Image RenderAssembly(const Assembly& assembly, const AssemblyPlan& plan);

/// The same before the first motion: all parts where they lie.
env::Image RenderAssemblyStart(const Assembly& assembly, const AssemblyPlan& plan);

}  // namespace feeler::workflow
