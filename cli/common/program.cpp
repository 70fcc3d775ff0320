#include "feeler/cli/common/program.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <exception>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "feeler/cli/common/console.h"
#include "feeler/cli/common/signals.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/interrupted.h"

namespace feeler::cli {
namespace {

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
    throw InputError("command line", fmt::format("unknown command \"{}\"", argv[i]), "choose one of " + names);
  }
}

std::function<void(const std::string&, int)>& Listener() {
  static std::function<void(const std::string&, int)> listener;
  return listener;
}

int Fail(std::string_view message, int code) {
  if (Listener()) {
    Listener()(std::string(message), code);
    return 0;
  }
  Note("feeler: error: {}\n", message);
  return code;
}

/// What the machine refuses is not a bug of ours and not a fault of the input: exit code 1.
int FailForLackOf(const char* what, const std::string& reason, const char* mend) {
  return Fail(Error(what, reason, mend).what(), 1);
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
  } catch (const InputError& e) {
    return Fail(e.what(), 2);
  } catch (const NegativeResult& e) {
    return Fail(e.what(), 1);
  } catch (const WorldError& e) {
    return Fail(e.what(), 1);
  } catch (const Interrupted&) {
    return 1;
  } catch (const Error& e) {
    return Fail(e.what(), 2);
  } catch (const std::filesystem::filesystem_error& e) {
    const std::string path = e.path1().empty() ? std::string("files") : e.path1().string();
    return Fail(InputError(path, e.code().message(), "check the name and the permissions").what(), 2);
  } catch (const std::bad_alloc&) {
    return FailForLackOf("memory", MemoryRefused(), kMemory);
  } catch (const std::length_error&) {
    return FailForLackOf("memory", "more was asked for than can be addressed", kMemory);
  } catch (const std::system_error& e) {
    return FailForLackOf("threads", "the system refused: " + e.code().message(),
                         "give fewer --jobs or raise the limit (ulimit -u, ulimit -v)");
  } catch (const nlohmann::json::type_error& e) {
    constexpr int kNotUtf8 = 316;
    if (e.id != kNotUtf8) return Fail(Error("internal", e.what(), "please report this").what(), 3);
    return Fail(InputError("command line", "a name is not UTF-8", "rename the file or folder").what(), 2);
  } catch (const std::exception& e) {
    if (std::string_view(e.what()).find("pthread_create") != std::string_view::npos) {  // oneTBB
      return FailForLackOf("threads", e.what(), "give fewer --jobs or raise the limit (ulimit -u, ulimit -v)");
    }
    return Fail(Error("internal", e.what(), "please report this").what(), 3);
  }
}

/// The last resort, where an exception leaves a thread: the same line, never an abort.
[[noreturn]] void OnTerminate() {
  SettleOutputsInSignalHandler();
  if (std::current_exception()) _exit(Explain());
  // An exception on its way out of a scope with threads that still run: one of them could not be started.
  if (std::uncaught_exceptions() == 0) _exit(3);
  _exit(FailForLackOf("threads", "the system refused one",
                      "give fewer --jobs or raise the limit (ulimit -u, ulimit -v)"));
}

/// The exit code of the command itself.
int Run(CLI::App& app, const Session& session, int argc, char** argv) {
  try {
    RequireKnownCommands(app, argc, argv);
    app.parse(argc, argv);
    return session.exit_code;
  } catch (const CLI::Success& e) {
    return app.exit(e);  // --help, --version
  } catch (const CLI::ParseError& e) {
    return Fail(InputError("command line", e.what(), "see feeler --help").what(), 2);
  } catch (...) {
    if (session.cancellation == nullptr || !session.cancellation->cancelled()) return Explain();
    Tell(std::string(InterruptedMessage()));
    return 1;
  }
}

}  // namespace

void TellErrorsTo(std::function<void(const std::string& message, int code)> listener) {
  Listener() = std::move(listener);
}

int ExplainException() { return Explain(); }

void BeginProgram(CancellationToken& cancellation) {
  OpenClosedStreams();
  std::set_terminate(OnTerminate);
  CancelOnSignals(cancellation);
}

int RunProgram(CLI::App& app, const Session& session, int argc, char** argv) {
  const int code = Run(app, session, argc, argv);
  const std::string_view lost = ResultsLost();
  if (lost.empty()) return code;
  return Fail(Error("standard output", fmt::format("the results could not be written: {}", lost),
                    "free some space or give another place")
                  .what(),
              code == 0 ? 1 : code);
}

}  // namespace feeler::cli
