#include "feeler/evaluation/cad_import/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <system_error>

#include "feeler/core/error.h"
#include "feeler/env/contact/axis_visibility.h"
#include "feeler/planner/options/solver_options.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/setup/database_builder.h"
#include "feeler/workflow/setup/planning_setup.h"
#include "feeler/workflow/setup/policy_registry.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

void Stage(const TrialOptions& options, const std::string& what) {
  if (options.on_stage) options.on_stage(what);
}

/// A file that goes when it is no longer needed.
class TemporaryDatabase {
 public:
  explicit TemporaryDatabase(fs::path file) : file_(std::move(file)) { Remove(); }
  ~TemporaryDatabase() { Remove(); }
  TemporaryDatabase(const TemporaryDatabase&) = delete;
  TemporaryDatabase& operator=(const TemporaryDatabase&) = delete;
  std::string path() const { return file_.string(); }

 private:
  void Remove() {
    std::error_code error;
    for (const char* suffix : {"", "-wal", "-shm", "-journal"}) fs::remove(file_.string() + suffix, error);
  }
  fs::path file_;
};

TrialRun RunEpisodesOf(const std::shared_ptr<const workflow::PlanningSetup>& setup, const std::string& policy,
                       std::shared_ptr<policies::Database> database, const planner::ProblemFamily& family,
                       const std::string& noise, const TrialOptions& options) {
  Stage(options, fmt::format("{} episodes, {}, policy {}", options.episodes, noise, policy));
  workflow::EpisodeOptions episode_options;
  episode_options.seed = options.seed;
  episode_options.family = family;
  episode_options.noise = noise;
  episode_options.ladder = workflow::UsesLadder(policy);
  const workflow::PolicyFactory factory = workflow::MakePolicyFactory(policy, std::move(database));
  const std::shared_ptr<const env::Scene> scene = workflow::BuildEpisodeScene(*setup);
  std::vector<EpisodeSummaryRow> rows;
  workflow::RunEpisodes(
      workflow::EpisodeRange(0, options.episodes), options.jobs,
      [&] { return workflow::EpisodeRunner(setup, scene, factory, episode_options); },
      [&](const workflow::EpisodeRecord& record) { rows.push_back(SummaryRow(record)); }, options.progress,
      options.cancellation);
  return {noise, policy, Summarize(rows)};
}

std::vector<std::string> FeltLines(const workflow::PlanningSetup& setup) {
  std::vector<std::string> lines;
  for (const env::AxisVisibility& axis : env::AxisVisibilities(setup.task(), *setup.map)) {
    lines.push_back(axis.felt() ? fmt::format("{}: neighbouring hypotheses differ in {} probes at least",
                                              ToString(axis.kind), axis.fewest_probes)
                                : fmt::format("{}: NOT felt, no probe differs by more than {:.3f} cells",
                                              ToString(axis.kind), axis.largest_difference_cells));
    if (axis.alike_pairs > 0) lines.back() += fmt::format("; {} of {} pairs are alike", axis.alike_pairs, axis.pairs);
  }
  return lines;
}

/// "ideal: 3 of 60 inserted, 4.2 s, 12 N at most (57 failed: 40 x off the policy tree, 17 x ...)".
std::string Describe(const TrialRun& run) {
  const RunSummary& summary = run.summary;
  std::string text = fmt::format("{}: {} of {} inserted", run.noise, summary.inserted.successes, summary.episodes);
  if (summary.inserted.successes > 0)
    text += fmt::format(", {:.1f} s, {:.0f} N at most", summary.sim_time_median_s, summary.peak_force_max_n);
  std::string reasons;
  for (const auto& [reason, count] : summary.failures)
    reasons += fmt::format("{}{} x {}", reasons.empty() ? "" : ", ", count, reason);
  return reasons.empty() ? text : fmt::format("{} (failed: {})", text, reasons);
}

}  // namespace

Trial RunTrial(const ImportedTask& task, const TrialOptions& options) {
  Trial trial;
  Stage(options, "contact map");
  workflow::PlanningSetupOptions setup_options;
  setup_options.jobs = options.jobs;
  setup_options.progress = options.progress;
  const auto begin = std::chrono::steady_clock::now();
  const auto setup = std::make_shared<const workflow::PlanningSetup>(
      workflow::LoadPlanningSetup(task.task_file.string(), setup_options));
  trial.map_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  trial.margin_cells = setup->map->margin_cells();
  trial.felt = FeltLines(*setup);

  std::vector<int> counts;
  for (const UncertainAxis& axis : setup->task().axes) counts.push_back(std::min(options.extent, axis.max_cells));
  const planner::Extents extents = planner::ExtentsAlong(planner::AxesOf(setup->task()), counts);
  const planner::ProblemFamily family{{extents}, planner::ToString(extents)};
  trial.extents = planner::ToString(extents);

  const TemporaryDatabase file(task.task_file.parent_path() / "trial.db");
  Stage(options, fmt::format("policy for {}", trial.extents));
  planner::PreprocessOptions preprocess;
  preprocess.solver = planner::FastSetting(planner::SolverKind::kCertified, 2.0);
  preprocess.solver.gap = 1.2;
  preprocess.jobs = options.jobs;
  preprocess.cancellation = options.cancellation;
  const workflow::DatabaseBuild build = workflow::BuildDatabase(*setup, family, preprocess, file.path());
  trial.solve_cpu_s = build.summary.cpu_s;
  trial.solved = build.summary.complete == 1;
  if (trial.solved) {
    auto database = std::make_shared<policies::Database>(policies::Database::OpenReadOnly(file.path()));
    const workflow::DatabaseVerification verification =
        workflow::VerifyDatabase(*setup, *database, options.jobs, {}, options.cancellation);
    trial.verified = verification.faults == 0 && verification.policies == 1;
    trial.why_not = verification.first_fault;
    for (const policies::StoredProblem& problem : database->List()) {
      trial.expected_cost_cells = problem.expected_cost;
      trial.ratio = problem.lower_bound > 0 ? problem.expected_cost / problem.lower_bound : 1.0;
    }
    for (const char* noise : {"ideal", "fall-in"}) {
      try {
        trial.runs.push_back(RunEpisodesOf(setup, "database", database, family, noise, options));
      } catch (const InputError& error) {
        trial.why_not = error.what();
      }
    }
  } else {
    trial.why_not = "no policy tells all hypotheses apart by touch";
    trial.runs.push_back(RunEpisodesOf(setup, "spiral", nullptr, family, "ideal", options));
  }
  return trial;
}

std::string Verdict(const ImportedTask& task, const std::optional<Trial>& trial) {
  const cad::Mating& mating = task.mating;
  const std::string parts = fmt::format("{} into {}, clearance {:.3f} x {:.3f} mm a side", task.tool.file,
                                        task.target.file, 1000 * mating.clearance_m.x(), 1000 * mating.clearance_m.y());
  if (!trial) return parts + ": imported and measured; not tried (leave out --no-trial).";
  if (!trial->solved) {
    const TrialRun* spiral = trial->runs.empty() ? nullptr : &trial->runs.front();
    return fmt::format("{}: touch alone cannot find it ({}){}.", parts, trial->why_not,
                       spiral == nullptr ? ""
                                         : fmt::format("; the spiral search inserts {} of {}",
                                                       spiral->summary.inserted.successes, spiral->summary.episodes));
  }
  std::string text = fmt::format("{}: {} solved within {:.2f} of the optimum and {}", parts, trial->extents,
                                 trial->ratio, trial->verified ? "verified" : "NOT verified");
  for (const TrialRun& run : trial->runs) text += "; " + Describe(run);
  return text + ".";
}

bool Works(const Trial& trial) {
  return trial.solved && trial.verified && !trial.runs.empty() &&
         std::all_of(trial.runs.begin(), trial.runs.end(),
                     [](const TrialRun& run) { return run.summary.inserted.successes > 0; });
}

}  // namespace feeler::evaluation
