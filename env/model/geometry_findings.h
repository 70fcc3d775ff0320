#pragma once

#include <string>

#include "feeler/env/model/task_file.h"
#include "feeler/env/model/task_finding.h"

namespace feeler::env {

/// Contradictions between the numbers of a task and its geometry: sizes in millimetres, a way in that is not free (with
/// what it looks like: a mesh whose hull fills the opening, a key turned the wrong way, origins that are not where they
/// belong), a lateral tolerance beyond the clearance, a start in collision. All prevent work.
TaskFindings GeometryFindings(const TaskModel& task_model, const std::string& where);

/// What closes the opening while the target is localized: no lid, a misnamed one, one that leaves the way in free.
TaskFindings LidFindings(const TaskModel& task_model, const std::string& where);

/// "geom west of body target", for people.
std::string NameOfTaskGeom(const mjModel& model, int geom);

}  // namespace feeler::env
