// feeler task check: everything that may be wrong with a task, said before it costs time.
#include "feeler/cli/task/task_check.h"

#include <algorithm>
#include <memory>
#include <thread>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/quick_check.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/workflow/check/task_check.h"

namespace feeler::cli {
namespace {

using env::TaskFinding;

struct TaskCheckFlags {
  std::string task;
  std::string opening = "closed";
  std::string table;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool json = false;
};

void Check(const TaskCheckFlags& flags, Session& session) {
  ProgressBar bar("contact map");
  workflow::TaskCheckOptions options;
  options.opening = ParseOpening(flags.opening);
  options.table = flags.table;
  options.jobs = Parallelism(flags.jobs);
  options.progress = Interruptible(bar, session);
  const env::TaskFindings findings = workflow::CheckTask(flags.task, options);
  bar.Finish();
  const bool prevents = workflow::Prevents(findings);
  if (flags.json) {
    PrintJson({{"task", flags.task}, {"works", !prevents}, {"findings", ToJson(findings)}});
  } else {
    for (const TaskFinding& finding : findings) Print("{:<8} {}\n", SeverityName(finding.severity), LineOf(finding));
    if (findings.empty()) Print("nothing found\n");
  }
  if (prevents) session.exit_code = 1;
}

}  // namespace

void AddTaskCheck(CLI::App& task, Session& session) {
  auto flags = std::make_shared<TaskCheckFlags>();
  CLI::App* command = task.add_subcommand(
      "check", "Everything that may be wrong with a task; exit code 0: nothing that prevents work, 1: that does");
  command->add_option("task", flags->task, "name, or path of a task file")->required();
  command->add_option("--opening", flags->opening, "closed or open while localizing")->capture_default_str();
  command->add_option("--table", flags->table, "uncertainty table of the task: does the task cap it?");
  AddJobs(*command, flags->jobs, "threads, for contact maps and trial episodes");
  command->add_flag("--json", flags->json, "print JSON");
  command->callback([flags, &session] { Check(*flags, session); });
}

}  // namespace feeler::cli
