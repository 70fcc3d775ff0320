// feeler run: seeded episodes in simulation.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
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
#include "feeler/cli/quick_check.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/interrupted.h"
#include "feeler/core/json_depth.h"
#include "feeler/core/parallelism.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/env/scene/scene.h"
#include "feeler/evaluation/records/episode_json.h"
#include "feeler/evaluation/records/fault_bands.h"
#include "feeler/evaluation/records/merge_records.h"
#include "feeler/evaluation/records/run_summary.h"
#include "feeler/evaluation/records/scene_geometry.h"
#include "feeler/policies/storage/hash.h"
#include "feeler/version.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/episode/episode_draw.h"
#include "feeler/workflow/episode/episode_faults.h"
#include "feeler/workflow/episode/episode_video.h"
#include "feeler/workflow/perception/perceive_table.h"
#include "feeler/workflow/scale/ordered_pieces.h"
#include "feeler/workflow/scale/shard.h"
#include "feeler/workflow/setup/contact_speeds.h"

namespace feeler::cli {
namespace {

/// Memory for their rows, some 1 kB each, is what bounds them.
constexpr std::int64_t kMostEpisodes = 10'000'000;

struct RunFlags {
  std::string task;
  std::string db;
  std::string policy = "database";
  std::vector<std::string> policy_options;
  std::string extents;
  std::string noise = "ideal";
  std::string placement = "nominal";
  std::string perception;
  std::string table;
  std::string prior;
  std::string out;
  std::string video;
  std::int64_t episodes = 1;
  std::uint64_t seed = 1;
  std::string versus;
  std::int64_t video_episode = 0;
  int jobs = 1;
  double confirm_limit_m = 0.0;  ///< 0: not given
  double force_budget_n = 0.0;   ///< 0: not given
  double wrist_stiffness_n_m = 0.0;
  std::string shard;
  bool no_ladder = false;
  bool withhold_true_pose = false;
  bool json = false;
};

/// The names, and a line about each.
std::string NoiseHelp() {
  std::string help = "one of these, or several with commas between:";
  for (const workflow::FaultName& noise : workflow::FaultNames()) help += "\n" + noise.name + ": " + noise.meaning;
  return help;
}

std::vector<std::string> Inputs(const RunFlags& flags) {
  std::vector<std::string> inputs = InputsOfTask(flags.task);
  inputs.insert(inputs.end(), {flags.db, flags.table, flags.prior});
  return inputs;
}

void RequireSane(const RunFlags& flags) {
  if (!flags.perception.empty() && flags.perception != "icp") {
    throw InputError("--perception", "unknown name \"" + flags.perception + "\"", "choose icp");
  }
  if (flags.perception.empty() != flags.table.empty()) {
    throw InputError("--table", "goes with --perception, and --perception with --table",
                     "make a table with feeler perceive calibrate");
  }
  if (!flags.prior.empty() && !flags.db.empty()) {
    throw InputError("--prior", "a database has the prior that it was made with", "leave out --prior or --db");
  }
  if (!flags.perception.empty() && !flags.extents.empty()) {
    throw InputError("--extents", "the camera decides on the problem", "leave out --extents or --perception");
  }
  RequireOutputs({{"--out", flags.out, FileKind::kRecords}, {"--video", flags.video, FileKind::kMp4}}, Inputs(flags));
  if (!flags.versus.empty() && flags.video.empty()) {
    throw InputError("--versus", "is about the video, and there is none", "add --video FILE.mp4");
  }
}

std::shared_ptr<const workflow::EpisodePerception> PerceptionFor(const std::string& table,
                                                                 const workflow::PlanningSetup& setup) {
  workflow::EpisodePerception perception;
  perception.table = workflow::LoadTable(table, setup.task(), env::Fingerprint(setup.model, env::Opening::kClosed));
  perception.finder =
      std::make_shared<const workflow::TargetFinder>(setup.model, workflow::SettingsOf(perception.table));
  return std::make_shared<const workflow::EpisodePerception>(std::move(perception));
}

/// Films --video-episode, with --versus a second time under that policy.
void WriteVideo(const RunFlags& flags, const Session& session,
                const std::function<workflow::EpisodeRunner()>& make_runner,
                const std::function<workflow::EpisodeRunner()>& make_versus) {
  ProgressBar bar("video frames");
  const auto episode = static_cast<std::uint64_t>(flags.video_episode);
  workflow::EpisodeRunner runner = make_runner();
  if (flags.versus.empty()) {
    workflow::RecordEpisodeVideo(runner, episode, flags.video, Interruptible(bar, session));
    return;
  }
  workflow::EpisodeRunner versus = make_versus();
  std::vector<workflow::EpisodeFilm> films;
  films.push_back(workflow::FilmEpisode(runner, episode, flags.policy));
  films.push_back(workflow::FilmEpisode(versus, episode, flags.versus));
  workflow::WriteVideo(films, flags.video, Interruptible(bar, session));
}

nlohmann::json ContactJson(const workflow::ContactSpeeds& speeds) {
  return {{"stiffness_n_m", speeds.stiffness_n_m},
          {"force_per_speed_n_s_m", speeds.force_per_speed_n_s_m},
          {"speed_m_s", speeds.speed_m_s}};
}

/// Everything that shapes the records, beside the number of episodes: what ranks and shards must have in common.
nlohmann::json SettingsJson(const RunFlags& flags, const workflow::PlanningSetup& setup, policies::Database* database) {
  nlohmann::json settings = {{"command", "run"},
                             {"version", FEELER_VERSION},
                             {"task", setup.task().name},
                             {"fingerprint of the task", setup.fingerprint},
                             {"content of the database", database != nullptr ? database->ContentDigest() : ""},
                             {"policy", flags.policy},
                             {"policy_options", flags.policy_options},
                             {"seed", flags.seed},
                             {"extents", flags.extents},
                             {"noise", flags.noise},
                             {"placement", flags.placement},
                             {"perception", flags.perception},
                             {"ladder", !flags.no_ladder},
                             {"confirm_limit_m", flags.confirm_limit_m},
                             {"force_budget_n", flags.force_budget_n}};
  if (!flags.table.empty()) {
    std::ifstream in(flags.table, std::ios::binary);
    settings["table"] = policies::HashText(std::string(std::istreambuf_iterator<char>(in), {}));
  }
  if (flags.wrist_stiffness_n_m > 0.0) settings["wrist_stiffness_n_m"] = flags.wrist_stiffness_n_m;
  if (!setup.prior_deviation.empty()) settings["prior_deviation"] = setup.prior_deviation;
  return settings;
}

void Run(const CLI::App& command, const RunFlags& flags, Session& session) {
  if (!session.serves()) RequireSane(flags);
  const Parallelism jobs = JobsOf(command, flags.jobs, session);
  const std::optional<workflow::Shard> shard = ShardOf(flags.shard);
  const workflow::Placement placement = workflow::ParsePlacement(flags.placement);
  workflow::ParseFaults(flags.noise);  // an unknown name fails before the contact map is built
  const env::SceneOptions scene_options = SceneOptionsOf(flags.wrist_stiffness_n_m);

  std::shared_ptr<policies::Database> database;
  if (!flags.db.empty()) {
    database = std::make_shared<policies::Database>(policies::Database::OpenReadOnly(flags.db));
  }
  workflow::PolicyOptions policy_options = workflow::ParsePolicyOptions(flags.policy_options);
  policy_options.store = TablesOfHost(session);
  const workflow::PolicyFactory policy_factory = workflow::MakePolicyFactory(flags.policy, database, policy_options);
  const workflow::PolicyFactory versus_factory =
      flags.versus.empty() ? policy_factory : workflow::MakePolicyFactory(flags.versus, database, policy_options);

  ProgressBar map_bar("contact map");
  workflow::PlanningSetupOptions setup_options;
  if (database) setup_options = workflow::SetupOptionsOf(database->identity());
  setup_options.jobs = TableJobsOf(jobs, session);
  setup_options.on_cache_failure = TellCacheFailure;
  setup_options.progress = Interruptible(map_bar, session);
  CheckQuickly(flags.task, setup_options.opening);
  workflow::PlanningSetup loaded = workflow::LoadPlanningSetup(flags.task, setup_options);
  if (!flags.prior.empty()) workflow::UsePrior(flags.prior, loaded);
  const auto setup = std::make_shared<const workflow::PlanningSetup>(std::move(loaded));
  map_bar.Finish();
  if (database) database->RequireFingerprint(setup->task().name, setup->fingerprint);

  workflow::EpisodeOptions options;
  options.seed = flags.seed;
  options.family = workflow::FamilyToDrawFrom(flags.extents, database.get(), setup->task());
  options.noise = flags.noise;
  options.placement = placement;
  if (!flags.perception.empty()) options.perception = PerceptionFor(flags.table, *setup);
  options.ladder = !flags.no_ladder && workflow::UsesLadder(flags.policy);
  if (flags.confirm_limit_m > 0.0) options.confirm_limit_m = flags.confirm_limit_m;
  if (flags.force_budget_n > 0.0) options.force_budget_n = flags.force_budget_n;
  const double force_budget_n =
      workflow::ForceBudget(setup->task(), workflow::ParseFaults(flags.noise), options.force_budget_n);
  if (!options.force_budget_n && force_budget_n > setup->task().force_budget_n) {
    Note("force budget: {:g} N, as the noise of the force sensor asks for\n", force_budget_n);
  }
  options.replay = !flags.out.empty();
  options.withhold_true_pose = flags.withhold_true_pose;
  const std::shared_ptr<const env::Scene> scene = workflow::BuildEpisodeScene(*setup, scene_options);
  const auto make_runner = [&] { return workflow::EpisodeRunner(setup, scene, policy_factory, options); };

  const std::vector<std::int64_t> episodes = workflow::NumbersOfShard(0, flags.episodes, shard);
  const auto make_worker = [&] {
    return [runner = make_runner()](std::int64_t episode) mutable {
      return evaluation::ToJson(runner.Run(static_cast<std::uint64_t>(episode))).dump();
    };
  };
  const nlohmann::json settings = SettingsJson(flags, *setup, database.get());
  if (session.serves()) return workflow::ServePieces(*session.ranks, settings.dump(), jobs, make_worker);
  if (session.ranks != nullptr) session.ranks->Assemble(settings.dump());

  std::optional<OutputFile> out;
  if (!flags.out.empty()) {
    out.emplace(flags.out, OutputFile::WhenInterrupted::kKeep);
    KeepsWhatIsDone();
    if (!out->direct()) {  // a pipe has no folder
      const std::string folder = std::filesystem::path(flags.out).parent_path().string();
      RequireOutputs({{"--out", evaluation::SceneFile(folder, setup->task().name), FileKind::kScene}}, Inputs(flags));
      evaluation::WriteSceneFile(*scene, folder);
    }
  }
  std::vector<evaluation::EpisodeSummaryRow> rows;
  evaluation::FaultBands bands;
  int solved_online = 0;  // though a database was to answer
  ProgressBar bar(WithRanks("episodes", session));
  const auto on_record = [&](std::size_t index, const std::string& line) {
    const auto record = ParseJsonText<nlohmann::json>(line);
    rows.push_back(evaluation::SummaryRow(record));
    bands.Add(record);
    if (flags.policy == "database" && rows.back().policy != flags.policy) ++solved_online;
    if (out) out->Write(line + "\n");
    bar.Update(static_cast<std::int64_t>(index) + 1, static_cast<std::int64_t>(episodes.size()));
  };
  try {
    workflow::RunPiecesInOrder(episodes, jobs, session.ranks, make_worker, on_record, session.cancellation);
  } catch (const Interrupted&) {  // by ranks that did not end in time
  } catch (const InputError&) {   // of the output: what is there is cut off
    throw;
  } catch (...) {  // of the world or the machine: what is done is kept
    if (out && !rows.empty()) out->Commit();
    throw;
  }
  bar.Finish();
  if (out && !rows.empty()) {
    out->Commit();
    if (shard && !out->direct()) evaluation::WriteRecordsShard(flags.out, {*shard, flags.episodes, settings});
  }
  NoteRanks(session, static_cast<std::int64_t>(rows.size()));

  if (!flags.video.empty() && !session.cancellation->cancelled()) {
    workflow::EpisodeOptions film_options = options;
    film_options.replay = false;  // the camera is the only observer
    const auto film = [&] { return workflow::EpisodeRunner(setup, scene, policy_factory, film_options); };
    const auto film_versus = [&] {
      workflow::EpisodeOptions versus_options = film_options;
      versus_options.ladder = !flags.no_ladder && workflow::UsesLadder(flags.versus);
      return workflow::EpisodeRunner(setup, scene, versus_factory, versus_options);
    };
    WriteVideo(flags, session, film, film_versus);
  }

  if (solved_online > 0) {
    Note("{} of {} episodes met problems that {} does not hold: solved online (feeler preprocess adds them)\n",
         solved_online, rows.size(), flags.db);
  }
  const evaluation::RunSummary summary = evaluation::Summarize(rows);
  const auto passed = std::ranges::count_if(rows, [&](const auto& row) { return row.peak_force_n > force_budget_n; });
  const auto speeds = workflow::NominalContactSpeeds(setup->model, force_budget_n, scene_options);
  if (flags.json) {
    nlohmann::json json = evaluation::ToJson(summary);
    json["task"] = setup->task().name;
    json["policy"] = flags.policy;
    json["solved_online"] = solved_online;
    json["force_budget_n"] = force_budget_n;
    json["force_budget_passed"] = passed;
    if (flags.wrist_stiffness_n_m > 0.0) json["wrist_stiffness_n_m"] = flags.wrist_stiffness_n_m;
    if (speeds) json["contact"] = ContactJson(*speeds);
    if (!bands.empty()) json["bands"] = bands.ToJson();
    json["noise"] = flags.noise;
    json["placement"] = workflow::ToString(options.perception ? workflow::Placement::kWorkspace : placement);
    json["perception"] = flags.perception.empty() ? nlohmann::json() : nlohmann::json(flags.perception);
    json["ladder"] = options.ladder;
    json["seed"] = flags.seed;
    if (session.ranks != nullptr) json["ranks"] = RanksJson(session, static_cast<std::int64_t>(rows.size()));
    PrintJson(json);
  } else {
    Print("task {}, policy {}, noise {}, seed {}: {} episodes\n{}", setup->task().name, flags.policy, flags.noise,
          flags.seed, summary.episodes, evaluation::ToText(summary));
    Print("force budget     {:g} N, passed in {} episodes\n", force_budget_n, passed);
    if (speeds) {
      Print("contact          {:.2f}, {:.2f}, {:.2f} N per mm/s along x, y, z\n",
            1e-3 * speeds->force_per_speed_n_s_m[0], 1e-3 * speeds->force_per_speed_n_s_m[1],
            1e-3 * speeds->force_per_speed_n_s_m[2]);
    }
    Print("{}", bands.ToText());
  }
  if (session.cancellation->cancelled()) {
    Note("feeler: interrupted after {} of {} episodes\n", summary.episodes, episodes.size());
    session.exit_code = 1;
  }
}

}  // namespace

void AddRunCommand(CLI::App& app, Session& session) {
  auto flags = std::make_shared<RunFlags>();
  CLI::App* command = app.add_subcommand("run", "Episodes in simulation: transfer, localize by touch, insert, score");
  command->add_option("--task", flags->task, "name under models/tasks/, or path of a task file")->required();
  command->add_option("--db", flags->db, "policy database of the task (feeler preprocess)");
  command->add_option("--policy", flags->policy, fmt::format("{}", fmt::join(workflow::PolicyNames(), ", ")))
      ->capture_default_str();
  command->add_option("--policy-option", flags->policy_options,
                      "KEY=VALUE, an option of the policy (docs/add-a-policy.md); may be given several times");
  AddInteger(*command, "--episodes", flags->episodes, 1, kMostEpisodes, "how many");
  AddSeed(*command, flags->seed, "of all draws");
  command->add_option("--extents", flags->extents,
                      "always this problem, e.g. 7x7x7 (default: drawn from the database)");
  command->add_option("--noise", flags->noise, NoiseHelp())->capture_default_str();
  command
      ->add_option("--placement", flags->placement,
                   "where the target stands: nominal (as the task file says) or workspace (anywhere in reach, turned)")
      ->capture_default_str();
  command->add_option("--perception", flags->perception,
                      "icp: hypotheses from a depth camera that looks at a target in the workspace (with --table)");
  command->add_option("--table", flags->table, "uncertainty table of the task (feeler perceive calibrate)");
  command->add_option("--prior", flags->prior,
                      "uncertainty table: policies that plan during the run take hypotheses to be as likely as its "
                      "errors say (a database has the prior it was made with)");
  command->add_flag("--no-ladder", flags->no_ladder, "the bare policy with its executor, without fallbacks");
  AddReal(*command, "--confirm-limit", flags->confirm_limit_m, 1e-6, 1.0,
          "touch until the position across the insertion is known this well, m, default: 0.0005", false);
  AddReal(
      *command, "--force-budget", flags->force_budget_n, 1e-3, 1e6,
      "no contact is to push harder, N: the tool comes as fast as that allows, default: the task's (25), more where "
      "the noise of the force sensor asks for it",
      false);
  AddWristStiffness(*command, flags->wrist_stiffness_n_m);
  command->add_flag("--withhold-true-pose", flags->withhold_true_pose,
                    "leave the true pose out of what the environment tells; the records stay the same");
  AddJobs(*command, flags->jobs, "threads; the records do not depend on it");
  command->add_option("--out", flags->out, "records, one JSON object a line (docs/file-formats.md)");
  command->add_option("--video", flags->video, "MP4 of one episode");
  command->add_option("--versus", flags->versus, "a second policy beside it in the video, on the same episode");
  AddInteger(*command, "--video-episode", flags->video_episode, 0, std::numeric_limits<std::int64_t>::max(),
             "which episode the video shows");
  command->add_flag("--json", flags->json, "print the summary as JSON");
  AddShard(*command, flags->shard, "the episodes, for feeler records merge");
  command->callback([command, flags, &session] { Run(*command, *flags, session); });
}

}  // namespace feeler::cli
