// feeler execute: finds the target and the bundle where they are asked for, then becomes feeler-execute, which links no
// simulator.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/perceived_target.h"
#include "feeler/core/error.h"
#include "feeler/policies/storage/database.h"
#include "feeler/policies/storage/task_bundle.h"
#include "feeler/workflow/setup/bundle.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::cli {
namespace {

constexpr const char* kTargetGroup = "The target, in place of --estimate and --extents";

struct ForwardedFlags {
  std::string task;
  std::string db;
  TargetSources sources;
};

/// The program beside this one, else the one on the path.
std::string ExecuteProgram() {
  std::array<char, PATH_MAX> own{};
  const ssize_t length = readlink("/proc/self/exe", own.data(), own.size() - 1);
  if (length > 0) {
    const auto beside = std::filesystem::path(std::string(own.data(), static_cast<std::size_t>(length))).parent_path() /
                        "feeler-execute";
    std::error_code error;
    if (std::filesystem::exists(beside, error)) return beside;
  }
  return "feeler-execute";
}

/// Databases of older versions have no bundle beside them: it is made where the task is given.
void EnsureBundle(const ForwardedFlags& flags) {
  std::error_code error;
  if (flags.task.empty() || flags.db.empty()) return;
  if (std::filesystem::exists(policies::BundlePathOf(flags.db), error)) return;
  policies::Database database = policies::Database::OpenReadOnly(flags.db);
  const workflow::PlanningSetup setup =
      workflow::LoadPlanningSetup(flags.task, workflow::SetupOptionsOf(database.identity()));
  database.RequireFingerprint(setup.task().name, setup.fingerprint);
  workflow::KeepBundle(setup, flags.db);
}

/// Becomes feeler-execute.
[[noreturn]] void Become(std::vector<std::string> arguments) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const std::string program = ExecuteProgram();
  execvp(program.c_str(), argv.data());
  throw InputError("feeler-execute", std::string("cannot be started: ") + std::strerror(errno),
                   "install it beside feeler");
}

/// The help of feeler-execute, and of what is added here.
void Help(const CLI::App& command) {
  const pid_t child = fork();
  if (child == 0) Become({"feeler execute", "--help"});
  int status = 0;
  while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  CLI::Formatter formatter;
  formatter.column_width(42);
  Print("{}", formatter.make_group(kTargetGroup, false, command.get_options([](const CLI::Option* option) {
    return option->get_group() == kTargetGroup;
  })));
}

void Execute(const ForwardedFlags& flags, const std::vector<std::string>& others) {
  std::vector<std::string> arguments = {"feeler execute"};
  const auto give = [&](const char* name, const std::string& value) {
    if (!value.empty()) arguments.insert(arguments.end(), {name, value});
  };
  give("--task", flags.task);
  give("--db", flags.db);
  if (flags.sources.any()) {
    const PerceivedTarget target = FindTarget(flags.task, flags.db, flags.sources);
    Note("feeler: target at {}, {} hypotheses ({})\n", target.estimate, target.hypotheses, target.extents);
    give("--estimate", target.estimate);
    give("--extents", target.extents);
  }
  arguments.insert(arguments.end(), others.begin(), others.end());
  EnsureBundle(flags);
  Become(std::move(arguments));
}

}  // namespace

void AddExecuteCommand(CLI::App& app, Session& /*session*/) {
  auto flags = std::make_shared<ForwardedFlags>();
  CLI::App* command = app.add_subcommand(
      "execute", "Carry a policy out on a robot, or its simulation, over a wire (docs/robot-protocol.md)");
  command->set_help_flag();  // feeler-execute has the options
  command->allow_extras();
  command->add_option("--task", flags->task, "the task of the database");
  command->add_option("--db", flags->db, "policy database of the task");
  const std::size_t before = command->get_options().size();
  AddTargetSources(*command, flags->sources);
  const std::vector<CLI::Option*> options = command->get_options();
  for (std::size_t i = before; i < options.size(); ++i) options[i]->group(kTargetGroup);
  command->callback([flags, command] {
    const std::vector<std::string> others = command->remaining();
    const auto asked = [&](const char* word) { return std::find(others.begin(), others.end(), word) != others.end(); };
    if (asked("--help") || asked("-h")) return Help(*command);
    Execute(*flags, others);
  });
}

}  // namespace feeler::cli
