// The `feeler` command. Exit codes: 0 done, 1 ran and the answer is no, 2 bad usage or input.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <exception>

#include "feeler/cli/commands.h"
#include "feeler/core/error.h"
#include "feeler/version.h"

namespace {

feeler::CancellationToken cancellation;  // reached from the signal handler

extern "C" void OnInterrupt(int signal_number) {
  cancellation.Cancel();
  std::signal(signal_number, SIG_DFL);  // a second Ctrl-C ends at once
}

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

int Fail(const char* message, int code) {
  fmt::print(stderr, "feeler: error: {}\n", message);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, OnInterrupt);
  std::signal(SIGTERM, OnInterrupt);
  std::signal(SIGPIPE, SIG_IGN);

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

  try {
    RequireKnownCommands(app, argc, argv);
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {
    return app.exit(e);  // --help, --version
  } catch (const CLI::ParseError& e) {
    return Fail(feeler::InputError("command line", e.what(), "see feeler --help").what(), 2);
  } catch (const feeler::NegativeResult& e) {
    return Fail(e.what(), 1);
  } catch (const feeler::WorldError& e) {
    return Fail(e.what(), 1);
  } catch (const feeler::Error& e) {
    return Fail(e.what(), 2);
  } catch (const std::exception& e) {
    return Fail(feeler::Error("internal", e.what(), "please report this").what(), 3);
  }
  return session.exit_code;
}
