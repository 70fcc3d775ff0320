// feeler task import: from CAD files to a task folder with its evidence.
#include "feeler/cli/task/task_import.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <memory>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "feeler/cad/readers/read_part.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/quick_check.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/evaluation/cad_import/import_report.h"
#include "feeler/evaluation/cad_import/import_task.h"
#include "feeler/evaluation/cad_import/table_uncertainty.h"
#include "feeler/evaluation/cad_import/trial.h"
#include "feeler/workflow/check/task_check.h"

namespace feeler::cli {
namespace {

struct TaskImportFlags {
  std::string tool;
  std::string target;
  std::string out;
  std::string unit;
  bool aligned = false;
  std::string tool_pose;
  std::string target_pose;
  std::string mouth;
  std::string uncertainty;
  std::string material = "abs";
  std::vector<std::string> set;
  double deviation = 0.1;
  bool no_trial = false;
  int episodes = 60;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool json = false;
};

/// "6mm", "0.25in", "6" (millimetres) in metres.
double ParseLength(const std::string& flag, std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  std::string unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
  if (error != std::errc() || !std::isfinite(value)) {
    throw InputError(flag, fmt::format("\"{}\" is not a length", text), "write 6mm, 0.6cm or 0.006m");
  }
  return value * cad::ParseUnit(unit.empty() ? "mm" : unit).metres;
}

std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t comma = text.find(','); comma != std::string::npos; comma = text.find(',', begin)) {
    parts.push_back(text.substr(begin, comma - begin));
    begin = comma + 1;
  }
  parts.push_back(text.substr(begin));
  return parts;
}

Eigen::Vector3d ParseLengths(const std::string& flag, const std::string& text) {
  std::vector<std::string> parts = SplitAtCommas(text);
  if (parts.size() == 1) parts.resize(3, parts.front());
  if (parts.size() != 3)
    throw InputError(flag, fmt::format("\"{}\" are not three lengths", text), "write for example 6mm,6mm,4mm");
  return {ParseLength(flag, parts[0]), ParseLength(flag, parts[1]), ParseLength(flag, parts[2])};
}

/// "x,y,z" or "x,y,z,qw,qx,qy,qz".
Pose ParsePose(const std::string& flag, const std::string& text) {
  const std::vector<std::string> parts = SplitAtCommas(text);
  if (parts.size() != 3 && parts.size() != 7) {
    throw InputError(flag, fmt::format("\"{}\" is not a pose", text),
                     "write x,y,z or x,y,z,qw,qx,qy,qz, lengths in mm");
  }
  const Eigen::Vector3d position(ParseLength(flag, parts[0]), ParseLength(flag, parts[1]), ParseLength(flag, parts[2]));
  if (parts.size() == 3) return MakePose(position);
  Eigen::Vector4d q;
  for (int k = 0; k < 4; ++k) {
    const std::string& part = parts[static_cast<std::size_t>(3 + k)];
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), q[k]);
    if (error != std::errc() || end != part.data() + part.size())
      throw InputError(flag, fmt::format("\"{}\" is not a number", part), "separate numbers with commas");
  }
  if (!(std::abs(q.norm() - 1) < 1e-3))
    throw InputError(flag, "the quaternion is not of length 1", "write qw,qx,qy,qz");
  return MakePose(position, Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized());
}

std::map<std::string, std::string> ParseSettings(const std::vector<std::string>& settings) {
  std::map<std::string, std::string> overrides;
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
      throw InputError("--set " + setting, "is not FIELD=VALUE", "for example feeler_max_cells=\"6 6 4\"");
    std::string field = setting.substr(0, equals);
    if (!field.starts_with("feeler_")) field = "feeler_" + field;
    overrides[field] = setting.substr(equals + 1);
  }
  return overrides;
}

/// Half widths, or a table that holds them.
void SetUncertainty(const std::string& text, evaluation::ImportOptions& options) {
  std::error_code error;
  if (text.ends_with(".json") || std::filesystem::is_regular_file(text, error)) {
    const evaluation::StatedUncertainty stated = evaluation::UncertaintyOfTable(text);
    options.uncertainty_m = stated.half_m;
    options.uncertainty_source = stated.source;
    if (!stated.note.empty()) Note("{}: {}\n", text, stated.note);
  } else {
    options.uncertainty_m = ParseLengths("--uncertainty", text);
    options.uncertainty_source = "as given";
  }
  if (options.uncertainty_m.minCoeff() < 0 || options.uncertainty_m.maxCoeff() > 0.064) {
    throw InputError("--uncertainty", fmt::format("\"{}\" is not between 0 and 64 mm", text),
                     "give half widths, e.g. 6mm,6mm,4mm");
  }
}

evaluation::ImportOptions OptionsFrom(const TaskImportFlags& flags) {
  evaluation::ImportOptions options;
  options.tool = flags.tool;
  options.target = flags.target;
  options.out = flags.out;
  options.unit = flags.unit;
  options.aligned = flags.aligned;
  if (flags.aligned && (!flags.tool_pose.empty() || !flags.target_pose.empty())) {
    throw InputError("--aligned", "contradicts --tool-pose and --target-pose", "give one or the other");
  }
  if (!flags.tool_pose.empty()) options.frame_T_tool = ParsePose("--tool-pose", flags.tool_pose);
  if (!flags.target_pose.empty()) options.frame_T_target = ParsePose("--target-pose", flags.target_pose);
  if (!flags.mouth.empty()) options.mouth_m = ParseLengths("--mouth", flags.mouth);
  if (!flags.uncertainty.empty()) SetUncertainty(flags.uncertainty, options);
  options.material = flags.material;
  options.overrides = ParseSettings(flags.set);
  if (!(flags.deviation > 0 && flags.deviation < 1))
    throw InputError("--deviation", "is not a share between 0 and 1", "0.1 is a tenth of the clearance");
  options.deviation_share = flags.deviation;
  options.on_stage = [](const std::string& what) { Note("{}\n", what); };
  return options;
}

void Print(const evaluation::ImportedTask& task, const std::string& verdict) {
  const cad::Mating& m = task.mating;
  cli::Print("task           {}\n", task.task_file.string());
  cli::Print("tool           {} ({}; {} triangles, {} convex pieces)\n", task.tool.file, task.tool.unit,
             task.tool.checked.mesh.size(), task.tool.pieces.size());
  cli::Print("target         {} ({}; {} triangles, {} convex pieces)\n", task.target.file, task.target.unit,
             task.target.checked.mesh.size(), task.target.pieces.size());
  cli::Print("clearance      {:.4f} x {:.4f} mm a side (pieces: {:.4f} x {:.4f})\n", 1000 * m.clearance_m.x(),
             1000 * m.clearance_m.y(), 1000 * task.pieces_clearance_m.x(), 1000 * task.pieces_clearance_m.y());
  cli::Print("lead-in        {:.4f} x {:.4f} mm\n", 1000 * m.lead_in_m.x(), 1000 * m.lead_in_m.y());
  cli::Print("depth          {:.4f} mm{}\n", 1000 * m.depth_m, m.through ? ", through" : "");
  cli::Print("deviation      tool {:.4f} mm, target {:.4f} mm where they mate; {:.4f} and {:.4f} anywhere\n",
             1000 * task.tool.mating.largest_m(), 1000 * task.target.mating.largest_m(),
             1000 * task.tool.anywhere.largest_m(), 1000 * task.target.anywhere.largest_m());
  cli::Print("cell           {:.4g} mm, margin {:.3f} cells\n", 1000 * task.content.numbers.cell_m,
             task.content.numbers.margin_cells);
  for (const std::string& note : task.notes) cli::Print("note           {}\n", note);
  for (const env::TaskFinding& finding : task.findings) cli::Print("finding        {}\n", LineOf(finding));
  cli::Print("verdict        {}\n", verdict);
}

/// What `feeler task check` says of the written task: all of it where contact maps are built for a trial anyway.
env::TaskFindings Findings(const evaluation::ImportedTask& task, bool with_touch, Parallelism jobs,
                           const Session& session) {
  ProgressBar bar("contact map");
  workflow::TaskCheckOptions options;
  options.jobs = jobs;
  options.progress = Interruptible(bar, session);
  options.touch = with_touch;
  env::TaskFindings findings = workflow::CheckTask(task.task_file.string(), options);
  bar.Finish();
  return findings;
}

void Import(const TaskImportFlags& flags, Session& session) {
  const evaluation::ImportOptions options = OptionsFrom(flags);
  const Parallelism jobs = Parallelism(flags.jobs);
  if (flags.episodes < 1) throw InputError("--episodes", "fewer than 1", "use --no-trial for none");
  evaluation::ImportedTask task = evaluation::ImportTask(options);
  const bool tried = !flags.no_trial && !session.cancellation->cancelled();
  task.findings = Findings(task, tried, jobs, session);
  std::optional<evaluation::Trial> trial;
  if (tried) {
    evaluation::TrialOptions trial_options;
    trial_options.episodes = flags.episodes;
    trial_options.jobs = jobs;
    trial_options.on_stage = options.on_stage;
    ProgressBar bar("trial");
    trial_options.progress = bar.Callback();
    trial_options.cancellation = session.cancellation;
    trial = evaluation::RunTrial(task, trial_options);
    bar.Finish();
  }
  WriteFileAtomically((options.out / "report.html").string(), evaluation::ImportReport(task, trial));
  const std::string verdict = evaluation::Verdict(task, trial);
  if (flags.json) {
    nlohmann::json json = task.json;
    json["task"] = task.task_file.string();
    json["verdict"] = verdict;
    json["findings"] = ToJson(task.findings);
    if (trial) {
      nlohmann::json runs = nlohmann::json::array();
      for (const evaluation::TrialRun& run : trial->runs) {
        nlohmann::json summary = evaluation::ToJson(run.summary);
        summary["noise"] = run.noise;
        summary["policy"] = run.policy;
        runs.push_back(summary);
      }
      json["trial"] = {{"extents", trial->extents},           {"solved", trial->solved},
                       {"verified", trial->verified},         {"ratio", trial->ratio},
                       {"margin_cells", trial->margin_cells}, {"runs", runs}};
    }
    PrintJson(json);
  } else {
    Print(task, verdict);
  }
  if (session.cancellation->cancelled()) session.exit_code = 1;
  if (trial && !evaluation::Works(*trial)) session.exit_code = 1;
}

}  // namespace

void AddTaskImport(CLI::App& task, Session& session) {
  auto flags = std::make_shared<TaskImportFlags>();
  CLI::App* command = task.add_subcommand(
      "import",
      "From CAD to a task folder: task.xml with every number derived, import.json, report.html (docs/add-a-part.md)");
  command
      ->add_option("--tool", flags->tool,
                   "what the robot holds: STEP, STL, OBJ, PLY or 3MF; FILE#2 or FILE#NAME takes one body of it")
      ->required();
  command->add_option("--target", flags->target, "what it goes into (or onto)")->required();
  command->add_option("--out", flags->out, "folder to write; an earlier import there is replaced, its --set are kept")
      ->required();
  command->add_option("--unit", flags->unit,
                      "mm, cm, m, in or um, of files that do not say (default: guessed by size)");
  command->add_flag("--aligned", flags->aligned, "both parts stand as assembled in their CAD frames");
  command->add_option("--tool-pose", flags->tool_pose,
                      "x,y,z[,qw,qx,qy,qz] of the tool's CAD frame, assembled; lengths in mm");
  command->add_option("--target-pose", flags->target_pose, "the same of the target, in the same frame");
  command->add_option("--mouth", flags->mouth, "x,y,z in the target's CAD frame: which mouth, where several fit");
  command->add_option("--uncertainty", flags->uncertainty,
                      "half widths of where the target may be, e.g. 6mm,6mm,4mm; 0: certain; or an uncertainty table "
                      "(feeler perceive calibrate)");
  command
      ->add_option("--material", flags->material,
                   "abs, aluminium, brass, nylon, rubber or steel: mass, friction and stiffness")
      ->capture_default_str();
  command->add_option("--set", flags->set,
                      "FIELD=VALUE of the task file, instead of what would be derived; may be given several times");
  AddReal(*command, "--deviation", flags->deviation, 0.0, 1.0,
          "largest deviation of the pieces where the parts mate, as a share of the clearance");
  command->add_flag("--no-trial", flags->no_trial, "do not solve and run episodes");
  AddInteger(*command, "--episodes", flags->episodes, 1, 1000000, "of each kind in the trial");
  AddJobs(*command, flags->jobs, "threads of the trial");
  command->add_flag("--json", flags->json, "print what was measured as JSON");
  command->callback([flags, &session] { Import(*flags, session); });
}

}  // namespace feeler::cli
