#pragma once

#include <CLI/CLI.hpp>

#include "feeler/cli/session.h"

namespace feeler::cli {

// One function a subcommand, each in a file of its own. The session outlives the app.
void AddTaskCommand(CLI::App& app, Session& session);
void AddSolveCommand(CLI::App& app, Session& session);
void AddPreprocessCommand(CLI::App& app, Session& session);
void AddDbCommand(CLI::App& app, Session& session);
void AddRunCommand(CLI::App& app, Session& session);
void AddAssembleCommand(CLI::App& app, Session& session);
void AddPerceiveCommand(CLI::App& app, Session& session);
void AddExportCommand(CLI::App& app, Session& session);
void AddPolicyCommand(CLI::App& app, Session& session);
void AddExperimentCommand(CLI::App& app, Session& session);
void AddReportCommand(CLI::App& app, Session& session);
void AddSimulateCommand(CLI::App& app, Session& session);
void AddExecuteCommand(CLI::App& app, Session& session);
void AddCellCommand(CLI::App& app, Session& session);
void AddRecordsCommand(CLI::App& app, Session& session);

}  // namespace feeler::cli
