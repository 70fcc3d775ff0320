#pragma once

#include <CLI/CLI.hpp>

#include "feeler/cli/session.h"

namespace feeler::cli {

/// `feeler task import`, under `feeler task`.
void AddTaskImport(CLI::App& task, Session& session);

}  // namespace feeler::cli
