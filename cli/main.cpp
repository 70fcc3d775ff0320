// The `feeler` command. Exit codes: 0 done, 1 ran and the answer is no, 2 bad usage or input.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/program.h"
#include "feeler/cli/common/signals.h"
#include "feeler/core/error.h"
#include "feeler/version.h"
#include "feeler/workflow/scale/ranks.h"
#ifdef FEELER_HAS_MPI
#include "feeler/workflow/scale/mpi/mpi_ranks.h"
#endif

namespace {

feeler::CancellationToken cancellation;  // reached from the signal handler

/// The processes that were started with this one, for the commands that use them; null where it is alone.
std::unique_ptr<feeler::workflow::Ranks> ConnectRanks(int argc, char** argv) {
  const int count = feeler::workflow::LaunchedRanks();
  const std::vector<std::string_view> words(argv + 1, argv + argc);
  const auto has = [&](std::string_view word) {
    return std::any_of(words.begin(), words.end(), [&](std::string_view w) {
      return w == word || (w.starts_with(word) && w.substr(word.size()).starts_with("="));
    });
  };
  if (count <= 1 || has("--shard") || has("--estimate")) return nullptr;
  if (feeler::workflow::LaunchedRank() > 0) {
    feeler::cli::Mute();
    feeler::cli::EndSilently();
  }
  if (words.empty() || has("--help") || has("--version")) return nullptr;
  const std::string_view command = words.front();
  if (command != "preprocess" && command != "run" && command != "assemble" &&
      !(command == "experiment" && !has("--list")) && !(command == "perceive" && has("calibrate"))) {
    throw feeler::InputError("ranks", fmt::format("{} ranks were started, feeler {} runs on one", count, command),
                             "start it without mpirun");
  }
#ifdef FEELER_HAS_MPI
  return feeler::workflow::ConnectMpiRanks(cancellation);
#else
  throw feeler::InputError("ranks", "this feeler was built without MPI",
                           "install libopenmpi-dev and openmpi-bin and build it again, or give --shard auto");
#endif
}

}  // namespace

int main(int argc, char** argv) {
  feeler::cli::BeginProgram(cancellation);

  std::unique_ptr<feeler::workflow::Ranks> ranks;
  try {
    ranks = ConnectRanks(argc, argv);
  } catch (...) {
    return feeler::cli::ExplainException();
  }
  if (ranks && ranks->rank() > 0) {  // rank 0 tells, and ends with the code
    feeler::cli::TellErrorsTo([&](const std::string& message, int code) { ranks->Fail(message, code); });
  }
  feeler::cli::Session session;
  session.cancellation = &cancellation;
  session.ranks = ranks.get();
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
  feeler::cli::AddRecordsCommand(app, session);
  feeler::cli::AddSimulateCommand(app, session);
  feeler::cli::AddExecuteCommand(app, session);
  feeler::cli::AddCellCommand(app, session);

  const int code = feeler::cli::RunProgram(app, session, argc, argv);
  feeler::cli::TellErrorsTo({});
  return code;
}
