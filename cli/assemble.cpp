// feeler assemble: structures, as sequences of insertions.
#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/common/signals.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/interrupted.h"
#include "feeler/core/parallelism.h"
#include "feeler/evaluation/records/statistics.h"
#include "feeler/policies/storage/database.h"
#include "feeler/version.h"
#include "feeler/workflow/assembly/assembly_builds.h"
#include "feeler/workflow/assembly/assembly_video.h"

namespace feeler::cli {
namespace {

struct AssembleFlags {
  std::string assembly;
  std::vector<std::string> databases;
  std::uint64_t seed = 1;
  std::int64_t builds = 1;
  int jobs = 1;
  std::string out;
  std::string video;
  double video_speed = 4.0;
  std::string render;
  bool check = false;
  bool no_ladder = false;
  bool json = false;
};

void RequireSane(const AssembleFlags& flags) {
  if (!flags.video.empty() && flags.builds > 1) {
    throw InputError("--video", "shows one build", "leave out --builds");
  }
  std::vector<std::string> inputs = flags.databases;
  inputs.push_back(flags.assembly);
  RequireOutputs({{"--out", flags.out, FileKind::kRecords},
                  {"--video", flags.video, FileKind::kMp4},
                  {"--render", flags.render, FileKind::kPng}},
                 inputs);
  if (!flags.check && flags.render.empty() && flags.databases.empty()) {
    throw InputError("--db", "missing", "give the database of each task (feeler preprocess), or --check");
  }
}

/// The structure as drawn.
void PrintDrawing(const workflow::Assembly& assembly, const workflow::AssemblyPlan& plan, bool json) {
  nlohmann::ordered_json steps = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < assembly.insertions.size(); ++i) {
    const workflow::AssemblyInsertion& step = assembly.insertions[i];
    const Pose& part = plan.world_T_part[static_cast<std::size_t>(step.part)];
    const Pose target = workflow::TargetPoseOf(assembly, step, plan.world_T_part[static_cast<std::size_t>(step.into)]);
    const Eigen::Vector3d way = target.linear() * UnitVector(assembly.TaskOf(step).insertion);
    const Eigen::Vector3d p = part.translation();
    if (!json) {
      Print("{:>3}  {:<10} into {:<16} {:<18} along {:+.2f} {:+.2f} {:+.2f}, ends at {:.3f} {:.3f} {:.3f} m\n", i,
            assembly.Part(step.part).name, assembly.Part(step.into).name + "." + assembly.PortOf(step).name, step.task,
            way.x(), way.y(), way.z(), p.x(), p.y(), p.z());
    }
    steps.push_back({{"part", assembly.Part(step.part).name},
                     {"into", assembly.Part(step.into).name},
                     {"port", assembly.PortOf(step).name},
                     {"task", step.task},
                     {"direction", {way.x(), way.y(), way.z()}},
                     {"part_position_m", {p.x(), p.y(), p.z()}}});
  }
  if (json) {
    PrintJson({{"assembly", assembly.name}, {"sound", true}, {"insertions", steps}});
  } else {
    Print("{}: {} insertions, sound\n", assembly.name, assembly.insertions.size());
  }
}

nlohmann::json RateJson(const evaluation::Rate& rate) {
  return {{"successes", rate.successes},
          {"trials", rate.trials},
          {"value", rate.value},
          {"low", rate.low},
          {"high", rate.high}};
}

void PrintSummary(const AssembleFlags& flags, const workflow::Assembly& assembly,
                  const std::vector<workflow::AssemblyRecord>& records, const Session& session) {
  const workflow::AssemblySummary summary = workflow::Summarize(records);
  const evaluation::Rate complete = evaluation::WilsonRate(summary.complete, summary.builds);
  const evaluation::Rate inserted = evaluation::WilsonRate(summary.inserted, summary.insertions);
  const double sim_time_s = evaluation::Median(summary.complete_sim_time_s);
  if (flags.json) {
    nlohmann::json json = {
        {"assembly", assembly.name},
        {"seed", flags.seed},
        {"builds", summary.builds},
        {"complete", RateJson(complete)},
        {"insertions", RateJson(inserted)},
        {"first_attempt", summary.first_attempt},
        {"ladder_used", summary.ladder_used},
        {"policies", summary.policies},
        {"largest_off_drawing", {{"lateral_m", summary.largest_lateral_m}, {"angle_rad", summary.largest_angle_rad}}},
        {"sim_time_s", {{"complete_median", sim_time_s}}},
        {"stops", nlohmann::json::array()}};
    for (const workflow::AssemblyRecord& record : records) {
      if (!record.complete) json["stops"].push_back({{"seed", record.seed}, {"reason", record.reason}});
    }
    if (session.ranks != nullptr) json["ranks"] = RanksJson(session, std::ssize(records));
    PrintJson(json);
    return;
  }
  Print(
      "{}: {} of {} builds complete ({:.1f} % to {:.1f} %), {} of {} insertions, {} at the first attempt, {} with "
      "a fallback; {:.0f} s a build (median)\n",
      assembly.name, summary.complete, summary.builds, 100 * complete.low, 100 * complete.high, summary.inserted,
      summary.insertions, summary.first_attempt, summary.ladder_used, sim_time_s);
  Print("ports off the drawing by up to {:.2f} mm and {:.4f} rad; policies:", 1e3 * summary.largest_lateral_m,
        summary.largest_angle_rad);
  for (const auto& [source, count] : summary.policies) Print(" {} {},", count, source);
  Print("\n");
  for (const workflow::AssemblyRecord& record : records) {
    if (!record.complete) Print("seed {}: {}\n", record.seed, record.reason);
  }
}

/// What all ranks must agree on.
std::string RankIdentity(const AssembleFlags& flags) {
  nlohmann::json json = {{"command", "assemble"},
                         {"version", FEELER_VERSION},
                         {"assembly", flags.assembly},
                         {"seed", flags.seed},
                         {"ladder", !flags.no_ladder}};
  for (const std::string& file : flags.databases) {
    json["content of the databases"].push_back(policies::Database::OpenReadOnly(file).ContentDigest());
  }
  return json.dump();
}

void Run(const CLI::App& command, const AssembleFlags& flags, Session& session) {
  if (!session.serves()) RequireSane(flags);
  if (session.ranks != nullptr && (flags.check || !flags.video.empty() || !flags.render.empty())) {
    throw InputError("ranks", "a check, a picture and a video are work for one", "start it without mpirun");
  }
  const Parallelism jobs = JobsOf(command, flags.jobs, session);
  const std::uint64_t seed = flags.seed;
  const workflow::Assembly assembly = workflow::LoadAssembly(flags.assembly);
  ProgressBar check_bar("checking");
  const workflow::AssemblyPlan plan = workflow::CheckAssembly(assembly, Interruptible(check_bar, session));
  check_bar.Finish();
  if (!flags.render.empty()) env::WritePng(workflow::RenderAssembly(assembly, plan), flags.render);
  if (flags.check || (flags.databases.empty() && !flags.render.empty())) {
    PrintDrawing(assembly, plan, flags.json);
    return;
  }
  ProgressBar map_bar("contact map");
  const workflow::AssemblyTasks tasks = workflow::LoadAssemblyTasks(
      assembly, flags.databases, TableJobsOf(jobs, session), Interruptible(map_bar, session));
  map_bar.Finish();

  workflow::AssemblyOptions options;
  options.seed = seed;
  options.ladder = !flags.no_ladder;
  options.cancellation = session.cancellation;
  if (session.serves()) {
    workflow::ServeAssemblies(assembly, plan, tasks, options, jobs, *session.ranks, RankIdentity(flags));
    return;
  }
  if (session.ranks != nullptr) session.ranks->Assemble(RankIdentity(flags));
  std::optional<OutputFile> out;
  if (!flags.out.empty()) {
    out.emplace(flags.out, OutputFile::WhenInterrupted::kKeep);
    KeepsWhatIsDone();
  }
  workflow::AssemblyFilm film;
  film.period_s = flags.video_speed / 25.0;
  if (!flags.video.empty()) options.film = &film;
  ProgressBar bar(WithRanks(session.ranks != nullptr ? "builds" : "insertions", session));
  std::vector<workflow::AssemblyRecord> records;
  const auto on_record = [&](const workflow::AssemblyRecord& record) {
    records.push_back(record);
    for (const auto& line : workflow::ToJsonLines(assembly, record)) {
      if (out) out->Write(line.dump() + "\n");
    }
  };
  const auto on_lines = [&](const std::vector<std::string>& lines) {
    records.push_back(workflow::SummaryRecord(lines));
    for (const std::string& line : lines) {
      if (out) out->Write(line + "\n");
    }
    bar.Update(static_cast<std::int64_t>(records.size()), flags.builds);
  };
  const int builds = static_cast<int>(flags.builds);
  try {
    if (session.ranks != nullptr) {
      workflow::BuildAssembliesOnRanks(assembly, plan, tasks, options, builds, jobs, *session.ranks, on_lines);
    } else {
      workflow::BuildAssemblies(assembly, plan, tasks, options, builds, jobs, on_record, bar.Callback());
    }
  } catch (const Interrupted&) {  // NOLINT(bugprone-empty-catch): by ranks that did not end in time
  } catch (const InputError&) {   // of the output: what is there is cut off
    throw;
  } catch (...) {  // of the world or the machine: what is done is kept
    if (out && !records.empty()) out->Commit();
    throw;
  }
  bar.Finish();
  if (out && !records.empty()) out->Commit();
  if (!flags.video.empty() && !records.empty()) {
    ProgressBar video_bar("video frames");
    workflow::WriteAssemblyVideo(assembly, film, records.front(), flags.video, Interruptible(video_bar, session));
  }
  NoteRanks(session, static_cast<std::int64_t>(records.size()));
  PrintSummary(flags, assembly, records, session);
  const bool one_stopped = flags.builds == 1 && !records.empty() && !records.front().complete;
  if (one_stopped || session.cancellation->cancelled()) session.exit_code = 1;
}

}  // namespace

void AddAssembleCommand(CLI::App& app, Session& session) {
  auto flags = std::make_shared<AssembleFlags>();
  CLI::App* command = app.add_subcommand("assemble", "Builds a structure in simulation, insertion by insertion");
  command
      ->add_option("--assembly", flags->assembly,
                   fmt::format("name under models/assemblies/ ({}), or path of a file",
                               fmt::join(workflow::ListAssemblies(), ", ")))
      ->required();
  command->add_option("--db", flags->databases, "policy database of a task (feeler preprocess); once for each task");
  AddSeed(*command, flags->seed, "of all draws");
  AddInteger(*command, "--builds", flags->builds, 1, 1'000'000, "how many, with the seeds from --seed on");
  AddJobs(*command, flags->jobs, "threads; the records do not depend on it");
  command->add_option("--out", flags->out, "records, one JSON object a line: each insertion, then the verdict");
  command->add_option("--video", flags->video, "MP4 of the build");
  AddReal(*command, "--video-speed", flags->video_speed, 0.25, 50.0, "how many times as fast as the robot");
  command->add_option("--render", flags->render, "PNG of the structure as drawn");
  command->add_flag("--check", flags->check, "check the assembly and print what is drawn; builds nothing");
  command->add_flag("--no-ladder", flags->no_ladder, "no fallbacks, and no second attempt");
  command->add_flag("--json", flags->json, "print the summary as JSON");
  command->callback([command, flags, &session] { Run(*command, *flags, session); });
}

}  // namespace feeler::cli
