// feeler db: look into a policy database.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/db_summary.h"
#include "feeler/cli/policy_output.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"
#include "feeler/core/parallelism.h"
#include "feeler/env/model/task_file.h"
#include "feeler/execution/contact/executor_options.h"
#include "feeler/planner/policy/evaluate.h"
#include "feeler/policies/storage/merge.h"
#include "feeler/workflow/setup/bundle.h"
#include "feeler/workflow/setup/contact_speeds.h"
#include "feeler/workflow/setup/database_builder.h"

namespace feeler::cli {
namespace {

struct DbFlags {
  std::string file;
  std::string extents;
  std::string task;
  std::string out;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool json = false;
};

nlohmann::json ProblemJson(const policies::StoredProblem& problem, const std::vector<AxisKind>& axes) {
  return {{"extents", planner::ToString(problem.extents, axes)},
          {"hypotheses", problem.extents.Count()},
          {"status", problem.status},
          {"solver", problem.solver},
          {"epsilon", problem.Promise()},  // for scripts of old: the gap of the certified solver too
          {"gap", problem.certified() ? nlohmann::json(problem.gap) : nlohmann::json()},
          {"expected_cost", problem.expected_cost},
          {"lower_bound", problem.lower_bound},
          {"ratio", problem.Ratio()},
          {"expansions", problem.expansions},
          {"seed", problem.seed},
          {"version", problem.version},
          {"cpu_s", problem.cpu_s},
          {"wall_s", problem.wall_s}};
}

workflow::PlanningSetup SetupFor(const policies::Database& database, const DbFlags& flags) {
  const policies::DatabaseIdentity& identity = database.identity();
  ProgressBar bar("contact map");
  workflow::PlanningSetupOptions options = workflow::SetupOptionsOf(identity);
  options.jobs = Parallelism(flags.jobs);
  options.progress = bar.Callback();
  workflow::PlanningSetup setup = workflow::LoadPlanningSetup(flags.task.empty() ? identity.task : flags.task, options);
  database.RequireFingerprint(setup.task().name, setup.fingerprint);
  return setup;
}

policies::StoredProblem Find(policies::Database& database, const DbFlags& flags) {
  auto stored = database.Get(planner::ParseExtents(flags.extents, database.identity().axes));
  if (!stored) {
    throw InputError(flags.file, "holds no problem " + flags.extents, "see feeler db list " + flags.file);
  }
  return *stored;
}

/// Budget that a plan in seconds was made for, and the greatest force predicted of its probes; empty for other costs,
/// and where the task is not at hand.
std::optional<std::pair<double, double>> ForceOf(const policies::DatabaseIdentity& identity) {
  if (workflow::SetupOptionsOf(identity).cost_kind != CostKind::kTime) return std::nullopt;
  try {
    const env::TaskModel model = env::LoadTask(identity.task);
    const auto speeds = workflow::NominalContactSpeeds(model, model.task.force_budget_n);
    if (!speeds) return std::nullopt;
    const execution::ExecutorOptions options;
    return std::pair{speeds->budget_n, workflow::WorstPredictedForce(*speeds, options.probe_speed_m_s)};
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void Info(const DbFlags& flags) {
  policies::Database database = policies::Database::OpenReadOnly(flags.file);
  const policies::DatabaseIdentity& identity = database.identity();
  if (flags.json) {
    nlohmann::json json = InfoJson(database.Info());
    json["task"] = identity.task;
    json["fingerprint"] = identity.fingerprint;
    json["opening"] = identity.opening;
    json["goal"] = identity.goal;
    nlohmann::json per_cell = identity.cost.per_cell;
    if (!identity.cost.one_per_cell()) {
      per_cell = {identity.cost.PerCell(0), identity.cost.PerCell(1), identity.cost.PerCell(2)};
    }
    json["cost"] = {
        {"per_cell", per_cell}, {"per_contact", identity.cost.per_contact}, {"per_action", identity.cost.per_action}};
    if (const auto force = ForceOf(identity)) {
      json["force_budget_n"] = force->first;
      json["worst_predicted_force_n"] = force->second;
    }
    json["cost_unit"] = workflow::CostUnit(identity);
    json["settings"] = ParseJsonText<nlohmann::json>(identity.settings);
    json["created_by"] = identity.created_by;
    if (identity.shard) {
      json["shard"] = {{"index", identity.shard->index},
                       {"count", identity.shard->count},
                       {"problems", identity.shard->problems},
                       {"family", identity.shard->family}};
    }
    json["content_digest"] = database.ContentDigest();
    PrintJson(json);
    return;
  }
  Print("task                {} ({})\n", identity.task, identity.fingerprint);
  Print("opening, goal       {}, {}\n", identity.opening, identity.goal);
  Print("settings            {}\n", identity.settings);
  if (identity.shard) {
    Print("shard               {} of {}: {} of the {} problems of the family\n", identity.shard->index,
          identity.shard->count, identity.shard->problems, identity.shard->family);
  }
  const CostWeights& cost = identity.cost;
  const std::string per_cell = cost.one_per_cell() ? fmt::format("{:g} a cell", cost.per_cell)
                                                   : fmt::format("{:g}, {:g}, {:g} a cell along x, y, z",
                                                                 cost.PerCell(0), cost.PerCell(1), cost.PerCell(2));
  Print("cost                {}, {:g} a contact, {:g} a move, in {}\n", per_cell, cost.per_contact, cost.per_action,
        workflow::CostUnit(identity));
  if (const auto force = ForceOf(identity)) {
    Print("force               planned for {:g} N, {:.1f} N at worst by prediction\n", force->first, force->second);
  }
  PrintInfo(database.Info(), workflow::CostUnit(identity));
  Print("content             {}\n", database.ContentDigest());
}

void List(const DbFlags& flags) {
  policies::Database database = policies::Database::OpenReadOnly(flags.file);
  const auto problems = database.List();
  if (flags.json) {
    nlohmann::json json = nlohmann::json::array();
    for (const auto& problem : problems) json.push_back(ProblemJson(problem, database.identity().axes));
    PrintJson(json);
    return;
  }
  Print("{:<10} {:>10} {:<16} {:>13} {:>11} {:>7} {:>10} {:>9}\n", "extents", "hypotheses", "status", "expected cost",
        "lower bound", "ratio", "expansions", "CPU s");
  for (const auto& p : problems) {
    Print("{:<10} {:>10} {:<16} {:>13.3f} {:>11.3f} {:>7.4f} {:>10} {:>9.4f}\n",
          planner::ToString(p.extents, database.identity().axes), p.extents.Count(), p.status, p.expected_cost,
          p.lower_bound, p.Ratio(), p.expansions, p.cpu_s);
  }
}

void Show(const DbFlags& flags) {
  policies::Database database = policies::Database::OpenReadOnly(flags.file);
  const policies::StoredProblem stored = Find(database, flags);
  nlohmann::json json = ProblemJson(stored, database.identity().axes);
  if (stored.policy) {
    const workflow::PlanningSetup setup = SetupFor(database, flags);
    const planner::Problem problem = setup.ProblemOf(stored.extents);
    const planner::PolicyEvaluation evaluation = planner::Evaluate(problem, *stored.policy);
    json["policy_nodes"] = stored.policy->nodes.size();
    json["worst_cost"] = evaluation.worst_cost;
    json["expected_moves"] = evaluation.expected_moves;
    json["expected_contacts"] = evaluation.expected_contacts;
  }
  if (flags.json) {
    PrintJson(json);
    return;
  }
  for (const auto& [key, value] : json.items()) {
    Print("{:<18} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
  }
}

void Verify(const DbFlags& flags, Session& session) {
  policies::Database database = policies::Database::OpenReadOnly(flags.file);
  const workflow::PlanningSetup setup = SetupFor(database, flags);
  ProgressBar bar("replaying");
  const workflow::DatabaseVerification result =
      workflow::VerifyDatabase(setup, database, Parallelism(flags.jobs), bar.Callback(), session.cancellation);
  bar.Finish();
  const bool cancelled = session.cancellation->cancelled();
  if (flags.json) {
    PrintJson({{"problems", result.problems},
               {"policies", result.policies},
               {"hypotheses", result.hypotheses},
               {"largest_cost_error", result.largest_cost_error},
               {"faults", result.faults},
               {"first_fault", result.first_fault},
               {"verified", result.faults == 0 && !cancelled}});
  } else {
    Print("{} of {} problems hold a policy; {} hypotheses replayed, largest cost error {:.2g}: {}\n", result.policies,
          result.problems, result.hypotheses, result.largest_cost_error,
          cancelled            ? "interrupted"
          : result.faults == 0 ? "every policy localizes every hypothesis at the stored cost"
                               : fmt::format("{} faults, first: {}", result.faults, result.first_fault));
  }
  if (result.faults > 0 || cancelled) session.exit_code = 1;
}

void Export(const DbFlags& flags) {
  policies::Database database = policies::Database::OpenReadOnly(flags.file);
  const policies::StoredProblem stored = Find(database, flags);
  if (!stored.policy) throw NegativeResult(flags.file, flags.extents + " holds no complete policy");
  std::vector<std::string> inputs = flags.task.empty() ? std::vector<std::string>() : InputsOfTask(flags.task);
  inputs.push_back(flags.file);
  RequireOutputs({{"--out", flags.out, FileKind::kPolicy}}, inputs);
  const workflow::PlanningSetup setup = SetupFor(database, flags);
  const planner::Problem problem = setup.ProblemOf(stored.extents);
  WritePolicy(problem, *stored.policy, setup.task().name, flags.out);
}

struct MergeFlags {
  std::vector<std::string> files;
  std::string out;
  bool json = false;
};

void Merge(const MergeFlags& flags, const Session& session) {
  RequireOutputs({{"--out", flags.out, FileKind::kDatabase}}, flags.files);
  ProgressBar bar("merging");
  const policies::MergeSummary summary =
      policies::MergeDatabases(flags.files, flags.out, bar.Callback(), session.cancellation);
  bar.Finish();
  if (flags.json) {
    PrintJson({{"files", summary.files}, {"problems", summary.problems}, {"content_digest", summary.digest}});
  } else {
    Print("{}: {} problems of {} files, content {}\n", flags.out, summary.problems, summary.files, summary.digest);
  }
}

void AddMerge(CLI::App& db, const Session& session) {
  auto flags = std::make_shared<MergeFlags>();
  CLI::App* command = db.add_subcommand("merge", "Put the shards of a family together");
  command->add_option("files", flags->files, "databases: all shards of a family, or disjoint families")->required();
  command->add_option("--out", flags->out, "database to write; one that exists is not overwritten")->required();
  command->add_flag("--json", flags->json, "print JSON");
  command->callback([flags, &session] { Merge(*flags, session); });
}

void Bundle(const DbFlags& flags) {
  const policies::Database database = policies::Database::OpenReadOnly(flags.file);
  const workflow::PlanningSetup setup = SetupFor(database, flags);
  database.RequireFingerprint(setup.task().name, setup.fingerprint);
  workflow::KeepBundle(setup, flags.file);
  const std::string path = policies::BundlePathOf(flags.file);
  if (flags.json) {
    PrintJson({{"bundle", path}, {"task", setup.task().name}});
  } else {
    fmt::print("{}: what an executor of {} needs without a simulator\n", path, setup.task().name);
  }
}

}  // namespace

void AddDbCommand(CLI::App& app, Session& session) {
  CLI::App* db = app.add_subcommand("db", "Look into a policy database");
  db->require_subcommand(1);
  const auto add = [db](const std::string& name, const std::string& help) {
    auto flags = std::make_shared<DbFlags>();
    CLI::App* command = db->add_subcommand(name, help);
    command->add_option("file", flags->file, "database file")->required();
    command->add_flag("--json", flags->json, "print JSON");
    return std::pair(command, flags);
  };
  const auto add_task = [](CLI::App* command, const std::shared_ptr<DbFlags>& flags) {
    command->add_option("--task", flags->task, "task file (default: the task the database names)");
    AddJobs(*command, flags->jobs, "threads");
  };
  {
    auto [command, flags] = add("info", "What it was made for; how many policies, how good, how large");
    command->callback([flags = flags] { Info(*flags); });
  }
  {
    auto [command, flags] = add("list", "A line a problem");
    command->callback([flags = flags] { List(*flags); });
  }
  {
    auto [command, flags] = add("show", "One problem and its policy's figures");
    command->add_option("--extents", flags->extents, "one count per axis of the task, e.g. 7x7x5")->required();
    add_task(command, flags);
    command->callback([flags = flags] { Show(*flags); });
  }
  {
    auto [command, flags] = add("verify", "Replay every policy under every hypothesis against the contact map");
    add_task(command, flags);
    command->callback([flags = flags, &session] { Verify(*flags, session); });
  }
  AddMerge(*db, session);
  {
    auto [command, flags] = add("bundle", "Write what an executor without a simulator needs of the task: FILE.bundle");
    add_task(command, flags);
    command->callback([flags = flags] { Bundle(*flags); });
  }
  {
    auto [command, flags] = add("export", "One policy as JSON (docs/file-formats.md)");
    command->add_option("--extents", flags->extents, "one count per axis of the task, e.g. 7x7x5")->required();
    command->add_option("--out", flags->out, "file to write (default: standard output)");
    add_task(command, flags);
    command->callback([flags = flags] { Export(*flags); });
  }
}

}  // namespace feeler::cli
