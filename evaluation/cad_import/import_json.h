#pragma once

#include <nlohmann/json.hpp>

#include "feeler/evaluation/cad_import/import_task.h"

namespace feeler::evaluation {

/// All that was measured, for import.json: metres, radians; no times and no folders, so that the same input gives the
/// same bytes.
nlohmann::json ImportJson(const ImportOptions& options, const ImportedTask& task);

}  // namespace feeler::evaluation
