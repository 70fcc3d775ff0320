// feeler preprocess: the policy database of a task.
#include <fmt/format.h>

#include <memory>
#include <thread>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/db_summary.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/parallelism.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/policies/io/problem_family_file.h"
#include "feeler/workflow/perception/perceive_table.h"
#include "feeler/workflow/setup/database_builder.h"

namespace feeler::cli {
namespace {

struct Flags {
  std::string task;
  std::string out;
  std::string family;
  std::string opening = "closed";
  std::string cost = "distance";
  std::string order = "uncertainty";
  std::string experience = "rollout";
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

void Run(const CLI::App& command, const Flags& flags, Session& session) {
  planner::PreprocessOptions options;
  options.solver = flags.solver.Options(command);
  options.seed = options.solver.seed;
  options.jobs = Parallelism(flags.jobs);
  options.cancellation = session.cancellation;
  if (flags.order == "random") {
    options.order = planner::ProblemOrder::kRandom;
  } else if (flags.order != "uncertainty") {
    throw InputError("--order", "unknown value \"" + flags.order + "\"", "choose one of uncertainty, random");
  }
  options.experience = ParseExperience(flags.experience);
  std::vector<std::string> inputs = InputsOfTask(flags.task);
  inputs.push_back(flags.family);
  RequireOutputs({{"--out", flags.out, FileKind::kDatabase}}, inputs);

  ProgressBar map_bar("contact map");
  workflow::PlanningSetupOptions setup_options;
  setup_options.opening = ParseOpening(flags.opening);
  setup_options.cost_kind = ParseCost(flags.cost);
  setup_options.jobs = options.jobs;
  setup_options.progress = Interruptible(map_bar, session);
  const workflow::PlanningSetup setup = workflow::LoadPlanningSetup(flags.task, setup_options);
  map_bar.Finish();
  const planner::ProblemFamily family = FamilyFor(flags.family, setup);
  workflow::RequireWithinTask(family, setup.task());

  ProgressBar table_bar("tables");
  options.solver.on_tables = Interruptible(table_bar, session);
  ProgressBar bar("problems");
  options.progress = bar.Callback();
  const workflow::DatabaseBuild build = workflow::BuildDatabase(setup, family, options, flags.out);
  bar.Finish();

  const planner::PreprocessSummary& summary = build.summary;
  Note("{} problems: {} solved now, {} already there, {} failed; {:.1f} s wall, {:.1f} s CPU{}\n", summary.problems,
       summary.complete, summary.skipped, summary.failed, summary.wall_s, summary.cpu_s,
       summary.cancelled ? "; interrupted, run the same command again to go on" : "");
  if (flags.json) {
    nlohmann::json json = InfoJson(build.info);
    json["cost_unit"] = workflow::CostUnit(setup.cost_kind, setup.task().cost);
    PrintJson(json);
  } else {
    PrintInfo(build.info, workflow::CostUnit(setup.cost_kind, setup.task().cost));
  }
  if (summary.cancelled || summary.failed > 0) session.exit_code = 1;
}

}  // namespace

void AddPreprocessCommand(CLI::App& app, Session& session) {
  auto flags = std::make_shared<Flags>();
  CLI::App* command = app.add_subcommand("preprocess", "Build (or continue) the policy database of a task");
  command->add_option("--task", flags->task, "name under models/tasks/, or path of a task file")->required();
  command->add_option("--out", flags->out, "database file; an existing one is continued")->required();
  command->add_option("--family", flags->family,
                      "problems, a range or count per axis of the task, e.g. 2..15x2..15x2..15, or a JSON file of them "
                      "or an uncertainty table "
                      "(default: the task's ranges)");
  command->add_option("--opening", flags->opening, "closed or open while localizing")->capture_default_str();
  command->add_option("--cost", flags->cost, "distance (the task's feeler_cost) or time, in seconds")
      ->capture_default_str();
  command->add_option("--order", flags->order, "uncertainty or random (e-rtdp-bel)")->capture_default_str();
  command->add_option("--experience", flags->experience, "rollout, naive or none (e-rtdp-bel)")->capture_default_str();
  AddJobs(*command, flags->jobs, "threads; the content does not depend on it");
  command->add_flag("--json", flags->json, "print the summary as JSON");
  flags->solver.AddTo(*command);
  command->callback([command, flags, &session] { Run(*command, *flags, session); });
}

}  // namespace feeler::cli
