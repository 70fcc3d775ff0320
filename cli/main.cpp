// The `feeler` command. Exit codes: 0 done, 1 ran and the answer is no, 2 bad usage or input.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <exception>

#include "cli/commands.h"
#include "core/error.h"

namespace {

feeler::CancellationToken cancellation;  // reached from the signal handler

extern "C" void OnInterrupt(int signal_number) {
  cancellation.Cancel();
  std::signal(signal_number, SIG_DFL);  // a second Ctrl-C ends at once
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
  feeler::cli::AddExportCommand(app, session);
  feeler::cli::AddPolicyCommand(app, session);
  feeler::cli::AddExperimentCommand(app, session);

  try {
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
