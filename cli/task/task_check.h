#pragma once

#include <CLI/CLI.hpp>

#include "feeler/cli/session.h"

namespace feeler::cli {

/// `feeler task check`, under `feeler task`.
void AddTaskCheck(CLI::App& task, Session& session);

}  // namespace feeler::cli
