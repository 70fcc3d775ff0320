// feeler solve: one problem, of a task or from a lattice file.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <memory>
#include <thread>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/noise/noisy_solve.h"
#include "feeler/cli/policy_output.h"
#include "feeler/cli/pomdp.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/parallelism.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/indistinguishable.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "feeler/workflow/perception/perceive_table.h"

namespace feeler::cli {
namespace {

struct SolveFlags {
  std::string task;
  std::string extents;
  std::string problem;
  std::string opening = "closed";
  std::string goal;
  std::string prior;
  std::string cost = "distance";
  std::string out;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool json = false;
  SolverFlags solver;
  NoiseFlags noise;
  PomdpFlags pomdp;
};

/// `noise`: of the problem's file, if it has any.
planner::Problem LoadProblem(const SolveFlags& flags, const Session& session, planner::Noise& noise) {
  if (flags.task.empty() == flags.problem.empty()) {
    throw InputError("solve", "give either --task with --extents, or --problem, or --pomdp", "see feeler solve --help");
  }
  if (!flags.problem.empty()) {
    if (ParseCost(flags.cost) == CostKind::kTime) {
      throw InputError("--cost time", "a lattice problem has no times", "put the weights into its file");
    }
    if (!flags.extents.empty()) {
      throw InputError("--extents", "goes with --task, not with --problem", "leave it out");
    }
    if (!flags.prior.empty()) {
      throw InputError("--prior", "goes with --task, not with --problem", "put weights into the problem's file");
    }
    planner::LatticeProblemData data = policies::ReadLatticeProblem(flags.problem);
    if (!flags.goal.empty()) data.goal = ParseGoal(flags.goal);
    noise = data.noise;
    data.noise = {};
    return planner::MakeLatticeProblem(data);
  }
  if (flags.extents.empty()) throw InputError("--extents", "missing", "give the extents, e.g. --extents 7x7x5");
  ProgressBar bar("contact map");
  workflow::PlanningSetupOptions options;
  options.opening = ParseOpening(flags.opening);
  options.cost_kind = ParseCost(flags.cost);
  if (!flags.goal.empty()) options.goal = ParseGoal(flags.goal);
  options.jobs = Parallelism(flags.jobs);
  options.progress = Interruptible(bar, session);
  workflow::PlanningSetup setup = workflow::LoadPlanningSetup(flags.task, options);
  if (!flags.prior.empty()) workflow::UsePrior(flags.prior, setup);
  const planner::Extents extents = planner::ParseExtents(flags.extents, setup.task());
  planner::RequireWithinTask({{extents}, flags.extents}, setup.task());
  return setup.ProblemOf(extents);
}

/// "[x, y, z]", and the orientation where there are several.
std::string NameOf(const planner::Problem& problem, int hypothesis) {
  const planner::Hypothesis& h = problem.hypotheses[static_cast<std::size_t>(hypothesis)];
  const std::string place = fmt::format("[{}, {}, {}]", h.offset.x(), h.offset.y(), h.offset.z());
  return problem.map->orientations() == 1 ? place : fmt::format("{} orientation {}", place, h.orientation);
}

/// JSON has no infinity: null.
void PrintResult(const planner::SolverResult& result, const std::string& unit) {
  Print("status         {}\n", planner::ToString(result.status));
  if (result.complete()) {
    Print("expected cost  {:.6g} {}\nlower bound    {:.6g}\nratio          {:.4f}\npolicy nodes   {}\n",
          result.expected_cost, unit, result.lower_bound, result.Ratio(), result.policy->nodes.size());
  } else {
    Print("lower bound    {:.6g}\n", result.lower_bound);
  }
  Print("expansions     {}\nCPU, wall      {:.3f} s, {:.3f} s\n", result.expansions, result.cpu_s, result.wall_s);
}

/// Says which hypotheses no probe tells apart, ten pairs of them; returns how many pairs there are.
std::int64_t NoteAlike(const planner::Problem& problem, const planner::ContactMasks& masks,
                       const planner::SolverResult& result, const std::string& task) {
  constexpr std::size_t kShown = 10;
  const std::int64_t count = planner::CountIndistinguishablePairs(problem, masks);
  const std::size_t shown = std::min(result.indistinguishable.size(), kShown);
  Note("feeler: {} pairs of hypotheses cannot be told apart by any probe{}:\n", count,
       count > static_cast<std::int64_t>(shown) ? fmt::format(", {} of them", shown) : "");
  for (std::size_t k = 0; k < shown; ++k) {
    const auto& [i, j] = result.indistinguishable[k];
    Note("  {} {} and {} {}\n", i, NameOf(problem, i), j, NameOf(problem, j));
  }
  if (!task.empty()) Note("feeler task check {} says why, and what would help\n", task);
  return count;
}

/// Prints the bounds as they close, to standard error.
std::function<void(const planner::BoundsRow&)> BoundsTable() {
  return [header = false](const planner::BoundsRow& row) mutable {
    if (!std::isfinite(row.lower_bound)) return;  // unlocalizable: said below
    if (!header) {
      Note("{:>9} {:>9} {:>12} {:>12} {:>12} {:>8}\n", "time s", "trials", "expansions", "lower", "upper", "ratio");
      header = true;
    }
    Note("{:>9.3f} {:>9} {:>12} {:>12.4f} {:>12.4f} {:>8.4f}\n", row.wall_s, row.trials, row.expansions,
         row.lower_bound, row.upper_bound, row.Ratio());
  };
}

/// With noise there is one heuristic.
void RequireNoHeuristic(const CLI::App& command) {
  for (const char* option : {"--heuristic", "--setting"}) {
    if (command.count(option) > 0) throw InputError(option, "does not go with noise", "leave it out");
  }
}

void Run(const CLI::App& command, const SolveFlags& flags, Session& session) {
  if (!flags.pomdp.pomdp.empty()) {
    return RunSolvePomdp(command, flags.pomdp, flags.solver, flags.out, flags.json, session);
  }
  RequireNoPomdpFlags(command);
  planner::SolverOptions options = flags.solver.Options(command);
  options.cancellation = session.cancellation;
  std::vector<std::string> inputs = flags.task.empty() ? std::vector<std::string>() : InputsOfTask(flags.task);
  inputs.insert(inputs.end(), {flags.problem, flags.prior});
  RequireOutputs({{"--out", flags.out, FileKind::kPolicy}}, inputs);
  planner::Noise noise;
  const planner::Problem problem = LoadProblem(flags, session, noise);
  noise = flags.noise.Over(command, noise);
  flags.noise.RequireNoise(command, noise);
  options.on_bounds = BoundsTable();
  const std::string unit = workflow::CostUnit(ParseCost(flags.cost), problem.cost);
  if (noise.any()) {
    RequireNoHeuristic(command);
    const std::string name = flags.task.empty() ? problem.name : flags.task;
    return RunSolveNoisy({problem, noise, flags.noise.declaration}, options, {name, unit, flags.out, flags.json});
  }
  planner::Validate(options);
  ProgressBar table_bar("tables");
  options.on_tables = Interruptible(table_bar, session);
  const std::clock_t tables_start = std::clock();
  const auto tables = planner::BuildPlanningTables(problem, options, Parallelism(flags.jobs));
  const double tables_cpu_s = static_cast<double>(std::clock() - tables_start) / CLOCKS_PER_SEC;
  table_bar.Finish();
  const planner::SolverResult result = planner::Solve(problem, options, tables);

  const std::int64_t alike = result.status == planner::SolverStatus::kUnlocalizable
                                 ? NoteAlike(problem, tables->masks(), result, flags.task)
                                 : 0;
  if (result.complete() && !flags.out.empty())
    WritePolicy(problem, *result.policy, flags.task.empty() ? problem.name : flags.task, flags.out);
  if (flags.json) {
    nlohmann::json pairs = nlohmann::json::array();
    for (const auto& [i, j] : result.indistinguishable) pairs.push_back({i, j});
    PrintJson({{"problem", problem.name},
               {"opening", flags.task.empty() ? nlohmann::json() : nlohmann::json(flags.opening)},
               {"status", planner::ToString(result.status)},
               {"solver", planner::ToString(options.solver)},
               {"setting", flags.solver.setting},
               {"heuristic", planner::ToString(options.heuristic)},
               {"hypotheses", problem.hypotheses.size()},
               {"expected_cost", NumberOrNull(result.expected_cost)},
               {"cost_unit", unit},
               {"lower_bound", NumberOrNull(result.lower_bound)},
               {"ratio", NumberOrNull(result.Ratio())},
               {"trials", result.trials},
               {"expansions", result.expansions},
               {"cpu_s", result.cpu_s},
               {"wall_s", result.wall_s},
               {"tables_cpu_s", tables_cpu_s},
               {"policy_nodes", result.complete() ? result.policy->nodes.size() : 0},
               {"indistinguishable_pairs", alike},
               {"indistinguishable", pairs}});
  } else {
    PrintResult(result, unit);
  }
  if (!result.complete()) session.exit_code = 1;
}

}  // namespace

void AddSolveCommand(CLI::App& app, Session& session) {
  auto flags = std::make_shared<SolveFlags>();
  CLI::App* command = app.add_subcommand("solve", "Solve one problem; prints the bounds as they close");
  command->add_option("--task", flags->task, "name under models/tasks/, or path of a task file");
  command->add_option("--extents", flags->extents, "hypotheses per axis of the task, e.g. 7x7x5 (with --task)");
  command->add_option("--problem", flags->problem, "lattice problem file (docs/file-formats.md)");
  command->add_option("--opening", flags->opening, "closed or open while localizing")->capture_default_str();
  command->add_option("--prior", flags->prior,
                      "uncertainty table of the task: hypotheses are as likely as its errors say");
  command->add_option("--goal", flags->goal, "singleton or insertable (default: the task's or file's)");
  command->add_option("--cost", flags->cost, "distance (the task's or file's weights) or time, in seconds")
      ->capture_default_str();
  command->add_option("--out", flags->out, "policy file to write");
  AddJobs(*command, flags->jobs, "threads, for contact map and tables");
  command->add_flag("--json", flags->json, "print the result as JSON");
  flags->solver.AddTo(*command);
  flags->noise.AddTo(*command);
  flags->pomdp.AddTo(*command);
  command->callback([command, flags, &session] { Run(*command, *flags, session); });
}

}  // namespace feeler::cli
