#pragma once

#include <mujoco/mujoco.h>

#include <string>

#include "feeler/core/task.h"

namespace feeler::env {

/// Reads and checks the feeler_* fields under <custom> of a compiled task file (docs/task-file.md) into a task: all but
/// name, file and the nominal pose of the target. `where` names the file in messages.
/// Throws InputError for a field that is missing, unknown, of the wrong size or out of range.
Task ReadTaskFields(const mjModel& model, const std::string& where);

}  // namespace feeler::env
