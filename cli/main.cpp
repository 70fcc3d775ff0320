// The `feeler` command. Exit codes: 0 done, 1 ran and the answer is no, 2 bad usage or input.
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/signals.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/interrupted.h"
#include "feeler/version.h"
#include "feeler/workflow/scale/ranks.h"
#ifdef FEELER_HAS_MPI
#include "feeler/workflow/scale/mpi/mpi_ranks.h"
#endif

namespace {

feeler::CancellationToken cancellation;  // reached from the signal handler
feeler::workflow::Ranks* ranks = nullptr;

/// CLI11 says of an unknown command that one is required; we name it and list the known.
void RequireKnownCommands(CLI::App& app, int argc, char** argv) {
  CLI::App* level = &app;
  for (int i = 1; i < argc; ++i) {
    const auto known = level->get_subcommands([](CLI::App*) { return true; });
    if (known.empty() || argv[i][0] == '-') return;
    CLI::App* next = nullptr;
    std::string names;
    for (CLI::App* command : known) {
      if (command->get_name() == argv[i]) next = command;
      names += (names.empty() ? "" : ", ") + command->get_name();
    }
    if (next != nullptr) {
      level = next;
      continue;
    }
    throw feeler::InputError("command line", fmt::format("unknown command \"{}\"", argv[i]), "choose one of " + names);
  }
}

int Fail(std::string_view message, int code) {
  if (ranks != nullptr && ranks->rank() > 0) {
    ranks->Fail(std::string(message), code);
    return 0;  // rank 0 tells and ends with the code
  }
  feeler::cli::Note("feeler: error: {}\n", message);
  return code;
}

/// What the machine refuses is not a bug of ours and not a fault of the input: exit code 1.
int FailForLackOf(const char* what, const std::string& reason, const char* mend) {
  return Fail(feeler::Error(what, reason, mend).what(), 1);
}

std::string MemoryRefused() {
  rlimit limit{};
  getrlimit(RLIMIT_AS, &limit);
  if (limit.rlim_cur == RLIM_INFINITY) return "the system refused to give more";
  return fmt::format("the limit is {} MB of address space", limit.rlim_cur >> 20);
}

/// The exception at hand as one line and an exit code.
int Explain() {
  constexpr const char* kMemory = "ask for less at once (fewer --jobs, smaller extents) or raise the limit (ulimit -v)";
  try {
    throw;
  } catch (const feeler::InputError& e) {
    return Fail(e.what(), 2);
  } catch (const feeler::NegativeResult& e) {
    return Fail(e.what(), 1);
  } catch (const feeler::WorldError& e) {
    return Fail(e.what(), 1);
  } catch (const feeler::Interrupted&) {
    return 1;
  } catch (const feeler::Error& e) {
    return Fail(e.what(), 2);
  } catch (const std::filesystem::filesystem_error& e) {
    const std::string path = e.path1().empty() ? std::string("files") : e.path1().string();
    return Fail(feeler::InputError(path, e.code().message(), "check the name and the permissions").what(), 2);
  } catch (const std::bad_alloc&) {
    return FailForLackOf("memory", MemoryRefused(), kMemory);
  } catch (const std::length_error&) {
    return FailForLackOf("memory", "more was asked for than can be addressed", kMemory);
  } catch (const std::system_error& e) {
    return FailForLackOf("threads", "the system refused: " + e.code().message(),
                         "give fewer --jobs or raise the limit (ulimit -u, ulimit -v)");
  } catch (const nlohmann::json::type_error& e) {
    constexpr int kNotUtf8 = 316;
    if (e.id != kNotUtf8) return Fail(feeler::Error("internal", e.what(), "please report this").what(), 3);
    return Fail(feeler::InputError("command line", "a name is not UTF-8", "rename the file or folder").what(), 2);
  } catch (const std::exception& e) {
    if (std::string_view(e.what()).find("pthread_create") != std::string_view::npos) {  // oneTBB
      return FailForLackOf("threads", e.what(), "give fewer --jobs or raise the limit (ulimit -u, ulimit -v)");
    }
    return Fail(feeler::Error("internal", e.what(), "please report this").what(), 3);
  }
}

/// The last resort, where an exception leaves a thread: the same line, never an abort.
[[noreturn]] void OnTerminate() {
  feeler::SettleOutputsInSignalHandler();
  if (std::current_exception()) _exit(Explain());
  // An exception on its way out of a scope with threads that still run: one of them could not be started.
  if (std::uncaught_exceptions() == 0) _exit(3);
  _exit(FailForLackOf("threads", "the system refused one",
                      "give fewer --jobs or raise the limit (ulimit -u, ulimit -v)"));
}

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
  if (command != "preprocess" && command != "run" && command != "experiment" && command != "assemble" &&
      !(command == "perceive" && has("calibrate"))) {
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

/// The exit code of the command itself.
int Run(CLI::App& app, const feeler::cli::Session& session, int argc, char** argv) {
  try {
    RequireKnownCommands(app, argc, argv);
    app.parse(argc, argv);
    return session.exit_code;
  } catch (const CLI::Success& e) {
    return app.exit(e);  // --help, --version
  } catch (const CLI::ParseError& e) {
    return Fail(feeler::InputError("command line", e.what(), "see feeler --help").what(), 2);
  } catch (...) {
    if (!cancellation.cancelled()) return Explain();
    feeler::cli::Tell("feeler: interrupted: what was done is kept\n");
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  feeler::cli::OpenClosedStreams();
  std::set_terminate(OnTerminate);
  feeler::cli::CancelOnSignals(cancellation);

  std::unique_ptr<feeler::workflow::Ranks> connection;
  try {
    connection = ConnectRanks(argc, argv);
  } catch (...) {
    return Explain();
  }
  ranks = connection.get();
  feeler::cli::Session session;
  session.cancellation = &cancellation;
  session.ranks = ranks;
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

  const int code = Run(app, session, argc, argv);
  const std::string_view lost = feeler::cli::ResultsLost();
  if (lost.empty()) return code;
  return Fail(feeler::Error("standard output", fmt::format("the results could not be written: {}", lost),
                            "free some space or give another place")
                  .what(),
              code == 0 ? 1 : code);
}
