// The `feeler` command. Exit codes: 0 done, 1 ran and the answer is no, 2 bad usage or input.
#include <CLI/CLI.hpp>
#include <string>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/program.h"
#include "feeler/version.h"

namespace {

feeler::CancellationToken cancellation;  // reached from the signal handler

}  // namespace

int main(int argc, char** argv) {
  feeler::cli::BeginProgram(cancellation);

  feeler::cli::Session session{&cancellation};
  CLI::App app{"Feeler plans and executes high-precision insertions by touch.", "feeler"};
  app.set_version_flag("--version", std::string("feeler ") + FEELER_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(42);
  feeler::cli::AddTaskCommand(app, session);
  feeler::cli::AddSolveCommand(app, session);
  feeler::cli::AddPreprocessCommand(app, session);
  feeler::cli::AddDbCommand(app, session);
  feeler::cli::AddRunCommand(app, session);
  feeler::cli::AddAssembleCommand(app, session);
  feeler::cli::AddPerceiveCommand(app, session);
  feeler::cli::AddExportCommand(app, session);
  feeler::cli::AddPolicyCommand(app, session);
  feeler::cli::AddExperimentCommand(app, session);
  feeler::cli::AddReportCommand(app, session);
  feeler::cli::AddSimulateCommand(app, session);
  feeler::cli::AddExecuteCommand(app, session);
  feeler::cli::AddCellCommand(app, session);

  return feeler::cli::RunProgram(app, session, argc, argv);
}
