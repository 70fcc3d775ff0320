#pragma once

#include <optional>
#include <string>

#include "feeler/evaluation/cad_import/import_task.h"
#include "feeler/evaluation/cad_import/trial.h"

namespace feeler::evaluation {

/// report.html of an import: one self-contained page with drawings, pictures, what was measured, the trial and a
/// verdict. Without a renderer on the machine the pictures are left out, and the page says so.
std::string ImportReport(const ImportedTask& task, const std::optional<Trial>& trial);

}  // namespace feeler::evaluation
