// feeler preprocess: the policy database of a task.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <thread>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/common/signals.h"
#include "feeler/cli/db_summary.h"
#include "feeler/cli/quick_check.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/parallelism.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/policies/io/problem_family_file.h"
#include "feeler/workflow/perception/perceive_table.h"
#include "feeler/workflow/scale/estimate.h"
#include "feeler/workflow/scale/job_model.h"
#include "feeler/workflow/scale/problem_wire.h"
#include "feeler/workflow/scale/shard.h"
#include "feeler/workflow/setup/database_builder.h"

namespace feeler::cli {
namespace {

struct PreprocessFlags {
  std::string task;
  std::string out;
  std::string family;
  std::string opening = "closed";
  std::string cost = "distance";
  std::string order = "uncertainty";
  std::string experience = "rollout";
  std::string prior;
  std::string shard;
  bool estimate = false;
  int ranks = 1;
  int sample = 64;
  std::string times;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool json = false;
  SolverFlags solver;
};

planner::ProblemFamily FamilyFor(const std::string& text, const workflow::PlanningSetup& setup) {
  const Task& task = setup.task();
  if (text.empty()) return planner::FamilyOf(task);
  if (workflow::IsTableFile(text)) {
    const std::string fingerprint = env::Fingerprint(setup.model, env::Opening::kClosed);
    return workflow::FamilyOfTable(workflow::LoadTable(text, task, fingerprint), task, text);
  }
  if (text.ends_with(".json")) return policies::ReadProblemFamily(text, task);
  return planner::ParseProblemFamily(text, task);
}

/// What all ranks must agree on.
std::string RankIdentity(const workflow::PlanningSetup& setup, const planner::ProblemFamily& family,
                         const planner::PreprocessOptions& options) {
  const policies::DatabaseIdentity identity = workflow::IdentityOf(setup, options);
  return nlohmann::json{{"command", "preprocess"},
                        {"version", identity.created_by},
                        {"task", identity.task},
                        {"fingerprint of the task", identity.fingerprint},
                        {"opening", identity.opening},
                        {"settings", identity.settings},
                        {"family", workflow::DatabaseShardOf(family, {}).digest}}
      .dump();
}

planner::PreprocessOptions OptionsOf(const workflow::PlanningSetup& setup, planner::PreprocessOptions options) {
  options.prior_deviation = setup.prior_deviation;
  return options;
}

/// Contact map and tables are there once.
std::int64_t MemoryOnOneHost(const workflow::FamilyEstimate& estimate, int ranks) {
  return estimate.shared_bytes + (estimate.rank_bytes - estimate.shared_bytes) * ranks;
}

void Estimate(const workflow::PlanningSetup& setup, const planner::ProblemFamily& family,
              planner::PreprocessOptions options, const PreprocessFlags& flags) {
  if (options.solver.solver == planner::SolverKind::kERtdpBel && options.experience != planner::ExperienceKind::kNone) {
    throw InputError("--estimate", "what e-rtdp-bel takes depends on the experience, which a sample does not have",
                     "give --experience none, or another --solver");
  }
  ProgressBar bar("sample");
  options.progress = bar.Callback();
  workflow::FamilyEstimate estimate;
  if (flags.times.empty()) {
    estimate = workflow::EstimateFamily(setup, family, options, flags.sample);
  } else {
    policies::Database measured = policies::Database::OpenReadOnly(flags.times);
    measured.RequireFingerprint(setup.task().name, setup.fingerprint);
    estimate = workflow::EstimateFromTimes(setup, family, options, measured);
  }
  bar.Finish();
  const workflow::JobModel model = workflow::ModelOf(estimate);
  const workflow::JobForecast alone = workflow::Simulate(model, 1);
  const workflow::JobForecast many = workflow::Simulate(model, flags.ranks);
  if (flags.json) {
    PrintJson({{"problems", estimate.problems},
               {"sampled", estimate.sampled},
               {"sample_cpu_s", estimate.sample_cpu_s},
               {"cpu_s", estimate.cpu_s},
               {"cpu_error", estimate.cpu_error},
               {"tables_s", estimate.tables_s},
               {"memory_per_rank_bytes", estimate.rank_bytes},
               {"memory_shared_per_host_bytes", estimate.shared_bytes},
               {"memory_bytes", MemoryOnOneHost(estimate, flags.ranks)},
               {"commit_s", estimate.commit_s},
               {"ranks", flags.ranks},
               {"wall_s", many.wall_s},
               {"wall_one_rank_s", alone.wall_s},
               {"efficiency", many.efficiency},
               {"longest_s", many.longest_s},
               {"committing_s", many.committing_s}});
    return;
  }
  if (flags.times.empty()) {
    Print("problems            {}, {} of them solved for this estimate in {:.1f} s CPU\n", estimate.problems,
          estimate.sampled, estimate.sample_cpu_s);
    Print("CPU time            {:.0f} s, +- {:.0f} % (one half of the sample about the other)\n", estimate.cpu_s,
          100 * estimate.cpu_error);
  } else {
    Print("problems            {}, with their times in {}\n", estimate.problems, flags.times);
    Print("CPU time            {:.0f} s\n", estimate.cpu_s);
  }
  Print("tables              {:.1f} s CPU, once a host\n", estimate.tables_s);
  Print("memory              {:.0f} MB a host and {:.0f} MB a rank, {:.1f} GB for {} on one host\n",
        static_cast<double>(estimate.shared_bytes) / 1e6,
        static_cast<double>(estimate.rank_bytes - estimate.shared_bytes) / 1e6,
        static_cast<double>(MemoryOnOneHost(estimate, flags.ranks)) / 1e9, flags.ranks);
  Print("wall time           {:.0f} s on 1 rank, {:.0f} s on {} (efficiency {:.2f})\n", alone.wall_s, many.wall_s,
        flags.ranks, many.efficiency);
  Print("limits              longest problem {:.2f} s; rank 0 commits for {:.1f} s\n", many.longest_s,
        many.committing_s);
}

/// Problems of the file that no touch solves: they are not failures of the solver.
void NoteUnlocalizable(const PreprocessFlags& flags, const Task& task) {
  policies::Database database = policies::Database::OpenReadOnly(flags.out);
  std::int64_t count = 0;
  std::string example;
  for (const policies::StoredProblem& problem : database.List()) {
    if (problem.status != planner::ToString(planner::SolverStatus::kUnlocalizable)) continue;
    if (count++ == 0) example = planner::ToString(problem.extents, task);
  }
  if (count == 0) return;
  Note(
      "feeler: {} problems are unlocalizable, {} for example: no touch tells some of their hypotheses apart (feeler "
      "task "
      "check {} says why)\n",
      count, example, flags.task);
}

void Run(const CLI::App& command, const PreprocessFlags& flags, Session& session) {
  if (flags.out.empty() && !flags.estimate) {
    throw InputError("--out", "missing", "give the database to write, or --estimate");
  }
  planner::PreprocessOptions options;
  options.solver = flags.solver.Options(command);
  options.seed = options.solver.seed;
  options.jobs = JobsOf(command, flags.jobs, session);
  options.store = TablesOfHost(session);
  options.table_jobs = TableJobsOf(options.jobs, session);
  options.cancellation = session.cancellation;
  if (flags.order == "random") {
    options.order = planner::ProblemOrder::kRandom;
  } else if (flags.order != "uncertainty") {
    throw InputError("--order", "unknown value \"" + flags.order + "\"", "choose one of uncertainty, random");
  }
  options.experience = ParseExperience(flags.experience);
  const std::optional<workflow::Shard> shard = ShardOf(flags.shard);
  std::vector<std::string> inputs = InputsOfTask(flags.task);
  inputs.insert(inputs.end(), {flags.family, flags.prior});
  if (!session.serves()) RequireOutputs({{"--out", flags.out, FileKind::kDatabase}}, inputs);

  CheckQuickly(flags.task, ParseOpening(flags.opening));
  ProgressBar map_bar("contact map");
  workflow::PlanningSetupOptions setup_options;
  setup_options.opening = ParseOpening(flags.opening);
  setup_options.cost_kind = ParseCost(flags.cost);
  setup_options.jobs = TableJobsOf(options.jobs, session);
  setup_options.on_cache_failure = TellCacheFailure;
  setup_options.progress = Interruptible(map_bar, session);
  workflow::PlanningSetup setup = workflow::LoadPlanningSetup(flags.task, setup_options);
  map_bar.Finish();
  if (!flags.prior.empty()) workflow::UsePrior(flags.prior, setup);
  const planner::ProblemFamily family = FamilyFor(flags.family, setup);
  planner::RequireWithinTask(family, setup.task());

  ProgressBar table_bar("tables");
  options.solver.on_tables = Interruptible(table_bar, session);
  ProgressBar bar(WithRanks("problems", session));
  options.progress = bar.Callback();
  if (flags.estimate) return Estimate(setup, family, OptionsOf(setup, options), flags);
  if (session.ranks != nullptr) {
    const std::string identity = RankIdentity(setup, family, options);
    if (session.serves()) {
      workflow::ServeProblems(*session.ranks, identity, setup.task(), setup.map, family, OptionsOf(setup, options));
      return;
    }
    session.ranks->Assemble(identity);
    options.distant = workflow::DistantSolvers(*session.ranks, family.problems.size());
  }
  std::optional<policies::DatabaseShard> part;
  if (shard) {
    options.only = std::make_shared<const std::vector<planner::Extents>>(workflow::ProblemsOfShard(family, *shard));
    part = workflow::DatabaseShardOf(family, *shard);
  }
  KeepsWhatIsDone();
  const workflow::DatabaseBuild build = workflow::BuildDatabase(setup, family, options, flags.out, part);
  bar.Finish();

  const planner::PreprocessSummary& summary = build.summary;
  Note("{} problems: {} solved now, {} already there, {} failed; {:.1f} s wall, {:.1f} s CPU{}\n", summary.problems,
       summary.complete, summary.skipped, summary.failed, summary.wall_s, summary.cpu_s,
       summary.cancelled ? "; interrupted, run the same command again to go on" : "");
  if (summary.failed > 0) NoteUnlocalizable(flags, setup.task());
  if (summary.helpers > 0) Note("{} problems of other shards solved for their policies\n", summary.helpers);
  NoteRanks(session, summary.complete + summary.failed);
  if (flags.json) {
    nlohmann::json json = InfoJson(build.info);
    json["cost_unit"] = workflow::CostUnit(setup.cost_kind, setup.task().cost);
    if (session.ranks != nullptr) json["ranks"] = RanksJson(session, summary.complete + summary.failed);
    PrintJson(json);
  } else {
    PrintInfo(build.info, workflow::CostUnit(setup.cost_kind, setup.task().cost));
  }
  if (summary.cancelled || summary.failed > 0) session.exit_code = 1;
}

}  // namespace

void AddPreprocessCommand(CLI::App& app, Session& session) {
  auto flags = std::make_shared<PreprocessFlags>();
  CLI::App* command = app.add_subcommand("preprocess", "Build (or continue) the policy database of a task");
  command->add_option("--task", flags->task, "name under models/tasks/, or path of a task file")->required();
  command->add_option("--out", flags->out, "database file; an existing one is continued");
  command->add_option("--family", flags->family,
                      "problems, a range or count per axis of the task, e.g. 2..15x2..15x2..15, or a JSON file of them "
                      "or an uncertainty table "
                      "(default: the task's ranges)");
  command->add_option(
      "--prior", flags->prior,
      "uncertainty table of the task (feeler perceive calibrate): hypotheses are as likely as its errors "
      "say (default: equally likely)");
  command->add_option("--opening", flags->opening, "closed or open while localizing")->capture_default_str();
  command->add_option("--cost", flags->cost, "distance (the task's feeler_cost) or time, in seconds")
      ->capture_default_str();
  command->add_option("--order", flags->order, "uncertainty or random (e-rtdp-bel)")->capture_default_str();
  command->add_option("--experience", flags->experience, "rollout, naive or none (e-rtdp-bel)")->capture_default_str();
  AddJobs(*command, flags->jobs, "threads; the content does not depend on it");
  command->add_flag("--estimate", flags->estimate,
                    "say what CPU, memory and wall time it will take, from a sample; writes nothing");
  AddInteger(*command, "--ranks", flags->ranks, 1, 1'000'000, "that the estimate is for");
  AddInteger(*command, "--sample", flags->sample, 2, 1'000'000, "problems that the estimate solves");
  command->add_option("--times", flags->times,
                      "a database of the family, for the estimate: the times it was made with instead of a sample");
  AddShard(*command, flags->shard, "the family, into a file of its own for feeler db merge");
  command->add_flag("--json", flags->json, "print the summary as JSON");
  flags->solver.AddTo(*command);
  command->callback([command, flags, &session] { Run(*command, *flags, session); });
}

}  // namespace feeler::cli
