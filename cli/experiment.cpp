// feeler experiment: one of the paper's tables or figures, measured, beside the printed values.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <system_error>
#include <thread>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/common/signals.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/parallelism.h"
#include "feeler/evaluation/experiment_on_ranks.h"
#include "feeler/evaluation/registry.h"

namespace feeler::cli {
namespace {

struct ExperimentFlags {
  std::string name;
  std::string out;
  bool list = false;
  bool quick = false;
  std::string task;
  std::string pomdps;
  std::uint64_t seed = 1;
  int solver_seeds = 0;
  std::string shard;
  std::vector<std::string> from;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
};

void List() {
  for (const evaluation::Experiment& experiment : evaluation::Experiments()) {
    Print("{:<24} {}\n", experiment.name, experiment.summary);
  }
}

void Run(const CLI::App& command, const ExperimentFlags& flags, Session& session) {
  if (flags.list) return List();
  if (flags.name.empty()) {
    throw InputError("experiment", "no name given", "choose one of " + evaluation::ExperimentNames());
  }
  const evaluation::Experiment& experiment = evaluation::FindExperiment(flags.name);
  if (flags.out.empty()) throw InputError("--out", "missing", "give a folder for the results");
  std::error_code error;
  if (std::filesystem::exists(flags.out, error) && !std::filesystem::is_directory(flags.out, error)) {
    throw InputError("--out", flags.out + " is a file", "give a folder");
  }

  if (!session.serves() && std::filesystem::is_directory(flags.out, error)) {
    RequireOutputs({{"--out", flags.out + "/" + flags.name + ".json", FileKind::kExperiment},
                    {"--out", flags.out + "/manifest.json", FileKind::kManifest}},
                   flags.task.empty() ? std::vector<std::string>() : InputsOfTask(flags.task));
  }

  ProgressBar map_bar("contact map");
  ProgressBar database_bar("policies");
  ProgressBar bar(session.ranks != nullptr ? WithRanks(flags.name, session) + ", part of rank 0" : flags.name);
  evaluation::ExperimentRequest request;
  request.out = flags.out;
  request.quick = flags.quick;
  request.jobs = JobsOf(command, flags.jobs, session);
  request.store = TablesOfHost(session);
  request.seed = flags.seed;
  request.task = flags.task;
  request.pomdps = flags.pomdps;
  request.shard = ShardOf(flags.shard);
  request.from = flags.from;
  request.solver_seeds = flags.solver_seeds;
  request.command = fmt::format("feeler experiment {} --out {}{}{}{}{} --seed {} --jobs {}", flags.name, flags.out,
                                flags.quick ? " --quick" : "", flags.task.empty() ? "" : " --task " + flags.task,
                                flags.pomdps.empty() ? "" : " --pomdps " + flags.pomdps,
                                flags.solver_seeds > 0 ? fmt::format(" --solver-seeds {}", flags.solver_seeds) : "",
                                flags.seed, request.jobs.threads());
  request.cancellation = session.cancellation;
  request.map_progress = Interruptible(map_bar, session);
  request.database_progress = database_bar.Callback();
  request.progress = bar.Callback();
  KeepsWhatIsDone();
  const evaluation::ExperimentOutcome outcome =
      session.ranks != nullptr ? evaluation::RunExperimentOnRanks(experiment, request, *session.ranks)
                               : evaluation::RunExperiment(experiment, request);
  if (session.serves()) return;
  map_bar.Finish();
  database_bar.Finish();
  bar.Finish();
  NoteRanks(session, session.ranks != nullptr ? session.ranks->size() : 0);
  if (request.shard && !session.cancellation->cancelled()) {
    Note("shard {} of {} is measured: give all their folders to feeler experiment {} --from\n", request.shard->index,
         request.shard->count, flags.name);
    return;
  }
  if (!outcome.complete) {
    Note("interrupted: what is done is kept in {}; run the same command again to go on\n", outcome.partial_file);
    session.exit_code = 1;
    return;
  }
  Print("{}", outcome.text);
}

}  // namespace

void AddExperimentCommand(CLI::App& app, Session& session) {
  auto flags = std::make_shared<ExperimentFlags>();
  CLI::App* command =
      app.add_subcommand("experiment", "Measure a table or figure of the paper beside its printed values");
  command->add_option("name", flags->name, "which; see --list");
  command->add_flag("--list", flags->list, "list the experiments");
  command->add_option("--out", flags->out,
                      "folder for NAME.csv, NAME.json and manifest.json; an interrupted run in it "
                      "is continued");
  command->add_flag("--quick", flags->quick, "few problems and short limits: a minute or two on two cores");
  command->add_option("--task", flags->task,
                      "name under models/tasks/, or path of a task file, for the experiments on planning (default: "
                      "plug)");
  command->add_option("--pomdps", flags->pomdps,
                      "folder of .pomdp and .pomdpx files that pomdp-benchmarks solves, too");
  AddInteger(*command, "--solver-seeds", flags->solver_seeds, 1, 1000,
             "repetitions of each attempt of a table (default: 3; 1 with --quick); more may be added to a "
             "finished folder",
             false);
  AddShard(*command, flags->shard, "the cells and episodes, into a folder of its own");
  command->add_option("--from", flags->from, "folders of shards, to go on from what they measured");
  AddSeed(*command, flags->seed, "of the sample and the first of the solver seeds");
  AddJobs(*command, flags->jobs, "threads; more than the cores would spoil the measured times");
  command->callback([command, flags, &session] { Run(*command, *flags, session); });
}

}  // namespace feeler::cli
