// feeler perceive: from a depth image or point cloud to hypotheses; and the uncertainty table that this takes.
#include "feeler/workflow/perception/perceive.h"

#include <fmt/format.h>

#include <iterator>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/common/signals.h"
#include "feeler/cli/perceived_target.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/json_depth.h"
#include "feeler/core/parallelism.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/task_file.h"
#include "feeler/perception/input_file.h"
#include "feeler/policies/storage/database.h"
#include "feeler/workflow/episode/episode_draw.h"
#include "feeler/workflow/perception/calibrate.h"
#include "feeler/workflow/perception/perceive_table.h"

namespace feeler::cli {
namespace {

struct PerceiveFlags {
  std::string task;
  TargetSources sources;
  std::string db;
  bool json = false;
};

struct CalibrateFlags {
  std::string task;
  std::string out;
  int poses = 1000;
  int installations = 5;
  int frames = 10;
  std::string shard;
  std::vector<std::string> from;
  std::uint64_t seed = 1;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool json = false;
};

void Perceive(const PerceiveFlags& flags) {
  RequireSources(flags.task, flags.sources);
  const env::TaskModel model = env::LoadTask(flags.task);
  const Task& task = model.task;
  const perception::UncertaintyTable table =
      workflow::LoadTable(flags.sources.table, task, env::Fingerprint(model, env::Opening::kClosed));
  planner::ProblemFamily family = workflow::FamilyOfTable(table, task, flags.sources.table);
  if (!flags.db.empty()) {
    policies::Database database = policies::Database::OpenReadOnly(flags.db);
    family.problems.clear();
    for (const policies::StoredProblem& problem : database.List()) family.problems.push_back(problem.extents);
  }
  const workflow::TargetFinder finder(model, workflow::SettingsOf(table));
  const perception::Registration found = Locate(flags.sources, finder, table, task.world_T_target.translation());
  if (!found.found)
    throw NegativeResult(flags.sources.depth + flags.sources.cloud, "target not found: " + found.reason);

  const perception::PoseHypotheses hypotheses = perception::HypothesesFor(table, found.world_T_target);
  const auto extents = workflow::SnapTo(family, task, hypotheses.counts);
  if (!extents) throw NegativeResult(flags.db, "holds no problem large enough for this estimate");
  const std::vector<int> counts = workflow::AxisExtents(task, *extents);
  if (!flags.json) {
    const Eigen::Vector3d& p = hypotheses.world_T_estimate.translation();
    Print("target at {:.4f} {:.4f} {:.4f} m, fitness {:.2f}; {} hypotheses ({})\n", p.x(), p.y(), p.z(), found.fitness,
          extents->Count(), planner::ToString(*extents));
    return;
  }
  nlohmann::ordered_json json;
  json["task"] = task.name;
  json["found"] = true;
  json["estimate"] = perception::PoseJson(hypotheses.world_T_estimate);
  json["registered"] = perception::PoseJson(found.world_T_target);
  json["extents"] = planner::ToString(*extents);
  json["axes"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < task.axes.size(); ++i) {
    json["axes"].push_back({{"axis", std::string(ToString(task.axes[i].kind))},
                            {"count", counts[i]},
                            {"resolution", task.axes[i].resolution}});
  }
  json["hypotheses"] = extents->Count();
  json["rule"] = hypotheses.rule;
  json["clamped"] = hypotheses.clamped;
  json["fitness"] = found.fitness;
  json["explained"] = found.explained;
  json["beyond"] = found.beyond;
  json["seen_through"] = found.seen_through;
  json["missing_m2"] = found.missing_m2;
  json["rms_m"] = found.rms_m;
  json["points"] = found.points;
  json["covariance"] = nlohmann::ordered_json::array();
  for (Eigen::Index row = 0; row < found.covariance.rows(); ++row) {
    const Eigen::VectorXd values = found.covariance.row(row);
    json["covariance"].push_back(std::vector<double>(values.data(), values.data() + values.size()));
  }
  Print("{}\n", json.dump(2));
}

std::string CoverageLine(const char* name, const perception::TableScore& score) {
  return fmt::format("{:<34} {:>5} of {:<5} ({:.2f} %)   {:.0f} hypotheses on average, {} at most\n", name,
                     score.covered, score.samples, score.samples > 0 ? 100.0 * score.covered / score.samples : 0.0,
                     score.mean_hypotheses, score.most_hypotheses);
}

std::string ErrorLine(const char* name, const workflow::ErrorSummary& errors) {
  constexpr double kDegree = 57.29577951308232;
  return fmt::format("{:<34} {:.1f} / {:.1f} / {:.1f} mm along, across, vertical; yaw {:.2f} deg; {} above 30 mm\n",
                     name, 1e3 * errors.along_p95_m, 1e3 * errors.across_p95_m, 1e3 * errors.vertical_p95_m,
                     kDegree * errors.yaw_p95_rad, errors.gross);
}

void Calibrate(const CLI::App& command, const CalibrateFlags& flags, Session& session) {
  workflow::CalibrationOptions options;
  options.poses = flags.poses;
  options.installations = flags.installations;
  options.seed = flags.seed;
  options.jobs = JobsOf(command, flags.jobs, session);
  options.shard = ShardOf(flags.shard);
  options.from = flags.from;
  options.ranks = session.ranks;
  options.perception.averaged_frames = flags.frames;
  if (options.shard) {
    options.partial = flags.out;
  } else if (IsReplaceable(flags.out)) {
    options.partial = flags.out + ".partial.jsonl";
  }
  if (!options.partial.empty()) KeepsWhatIsDone();
  options.cancellation = session.cancellation;
  options.Validate();
  std::vector<std::string> inputs = InputsOfTask(flags.task);
  inputs.insert(inputs.end(), flags.from.begin(), flags.from.end());
  if (!session.serves() && !options.shard) RequireOutputs({{"--out", flags.out, FileKind::kTable}}, inputs);
  const env::TaskModel model = env::LoadTask(flags.task);
  if (session.serves()) return workflow::ServeCalibration(model, options);
  ProgressBar bar(WithRanks("poses", session));
  options.progress = bar.Callback();
  const workflow::Calibration calibration = workflow::Calibrate(model, options);
  bar.Finish();
  NoteRanks(session, std::ssize(calibration.samples));
  if (options.shard && !session.cancellation->cancelled()) {
    Note("shard {} of {}: {} poses in {}; give all shards to feeler perceive calibrate --from\n", options.shard->index,
         options.shard->count, calibration.samples.size(), flags.out);
    return;
  }
  if (!calibration.complete) {
    Note("interrupted after {} of {} poses; run the same command again to go on\n", calibration.samples.size(),
         2 * flags.poses);
    session.exit_code = 1;
    return;
  }
  const std::string report = workflow::ReportJson(calibration, options);
  WriteFileAtomically(flags.out, perception::ToJson(calibration.table, report));
  workflow::RemovePartial(options);
  if (flags.json) {
    nlohmann::json json = ParseJsonText<nlohmann::json>(report);
    if (session.ranks != nullptr) json["ranks"] = RanksJson(session, std::ssize(calibration.samples));
    PrintJson(json);
    return;
  }
  std::string text = fmt::format(
      "task {}: {} poses and {} installations for the table, as many others to judge it; {} "
      "targets not found\n",
      model.task.name, flags.poses, flags.installations, calibration.not_found);
  text += workflow::NegativesLine(calibration.negatives);
  text += ErrorLine("95 % of errors below", workflow::SummarizeErrors(calibration, false));
  text += ErrorLine("the same without bias", workflow::SummarizeErrors(calibration, true));
  text += CoverageLine("truth within hypotheses, held out", calibration.held_out);
  text += CoverageLine("without bias correction (paper)", calibration.held_out_plain);
  Print("{}", text);
}

}  // namespace

void AddPerceiveCommand(CLI::App& app, Session& session) {
  auto flags = std::make_shared<PerceiveFlags>();
  CLI::App* command =
      app.add_subcommand("perceive", "Hypotheses from a depth image or point cloud; calibrate: the table this takes");
  command->add_option("--task", flags->task, "name under models/tasks/, or path of a task file");
  AddTargetSources(*command, flags->sources);
  command->add_option("--db", flags->db, "give the smallest problem of this database that covers the estimate");
  command->add_flag("--json", flags->json, "print the result as JSON");

  auto calibrate = std::make_shared<CalibrateFlags>();
  CLI::App* nested =
      command->add_subcommand("calibrate", "Make the uncertainty table of a task from simulated captures");
  nested->add_option("--task", calibrate->task, "name under models/tasks/, or path of a task file")->required();
  nested->add_option("--out", calibrate->out, "table file (JSON)")->required();
  AddInteger(*nested, "--poses", calibrate->poses, 1, 1000000, "to make it from; as many others judge it");
  AddInteger(*nested, "--installations", calibrate->installations, 1, 1000000,
             "of the camera; as many others judge it");
  AddInteger(*nested, "--frames", calibrate->frames, 1, 1000, "averaged for a picture");
  AddSeed(*nested, calibrate->seed, "of all draws");
  AddJobs(*nested, calibrate->jobs, "threads; the table does not depend on it");
  AddShard(*nested, calibrate->shard, "the poses, into the file of --out");
  nested->add_option("--from", calibrate->from, "what shards of this calibration wrote: the poses that it begins with");
  nested->add_flag("--json", calibrate->json, "print the report as JSON");
  nested->callback([nested, calibrate, &session] { Calibrate(*nested, *calibrate, session); });
  command->callback([flags, command] {
    if (command->get_subcommands().empty()) Perceive(*flags);
  });
}

}  // namespace feeler::cli
