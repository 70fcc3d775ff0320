#include "feeler/evaluation/harness/episode_sweep.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <system_error>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"
#include "feeler/evaluation/harness/cell_store.h"
#include "feeler/evaluation/records/episode_json.h"
#include "feeler/evaluation/records/scene_geometry.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/version.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/episode/episode_draw.h"
#include "feeler/workflow/setup/database_builder.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

/// Certified ratio up to which the policies of the episodes are solved: the default of `feeler preprocess`.
constexpr double kGap = 1.2;

/// The records that a file holds, without a last line that was cut off while it was written.
/// `numbers`: the episodes that it holds, one after the other.
std::vector<json> ReadFinished(const std::string& path, const EpisodeSetting& setting, std::uint64_t seed,
                               const std::vector<std::int64_t>& numbers) {
  std::vector<json> records;
  std::ifstream in(path, std::ios::binary);
  if (!in) return records;
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string noise = workflow::ParseFaults(setting.noise).name;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;
    const std::string_view bytes = std::string_view(text).substr(begin, end - begin);
    auto record = ParseJsonText<json>(bytes);
    const auto is = [&](const char* key, const json& value) { return record.contains(key) && record[key] == value; };
    const bool expected = records.size() < numbers.size();
    if (!record.is_object() || !expected || !is("episode", numbers[records.size()]) || !is("seed", seed) ||
        !is("noise", noise)) {
      throw InputError(path + " line " + std::to_string(records.size() + 1), "is not the record expected there",
                       "choose another folder, or move this one away");
    }
    records.push_back(std::move(record));
    begin = end + 1;
  }
  std::error_code error;
  if (begin < text.size()) std::filesystem::resize_file(path, begin, error);
  if (error) throw InputError(path, "cannot be written: " + error.message(), "check its permissions");
  return records;
}

/// The records of shards, by episode.
std::map<std::int64_t, json> ReadShards(const std::vector<std::string>& files, const EpisodeSetting& setting,
                                        std::uint64_t seed) {
  std::map<std::int64_t, json> records;
  for (const std::string& file : files) {
    std::ifstream in(file, std::ios::binary);
    int number = 0;
    for (std::string line; std::getline(in, line) && !in.eof();) {  // a last line that is cut off is none
      ++number;
      auto record = ParseJsonText<json>(line);
      const bool good = record.is_object() && record.value("seed", json()) == json(seed) &&
                        record.value("noise", json()) == json(workflow::ParseFaults(setting.noise).name) &&
                        record.value("episode", json()).is_number_integer();
      const auto where = file + " line " + std::to_string(number);
      if (!good) throw InputError(where, "is no record of this setting", "give folders of shards of this experiment");
      const auto episode = record["episode"].get<std::int64_t>();
      if (!records.emplace(episode, std::move(record)).second) {
        throw InputError(where, "holds episode " + std::to_string(episode) + ", as another shard does",
                         "give each shard once");
      }
    }
  }
  return records;
}

std::string FileName(const std::string& name) {
  std::string file = name;
  std::replace(file.begin(), file.end(), ' ', '_');
  return file + ".jsonl";
}

}  // namespace

json ToJson(const EpisodeSetting& setting) {
  return {{"name", setting.name},
          {"task", setting.task},
          {"policy", setting.policy},
          {"cost", setting.cost},
          {"extents", setting.extents},
          {"placement", setting.placement},
          {"policy_options", setting.policy_options},
          {"noise", setting.noise},
          {"ladder", setting.ladder},
          {"bare_of", setting.bare_of},
          {"confirm_limit_m", setting.confirm_limit_m ? json(*setting.confirm_limit_m) : json()},
          {"episodes", setting.episodes}};
}

EpisodeStatistics StatisticsOf(const std::vector<json>& records) {
  EpisodeStatistics statistics;
  int inserted = 0;
  int localized = 0;
  int ladder_used = 0;
  std::vector<double> times, errors, moves, contacts, paths, inserted_paths, forces, impulses, forbidden, plan, cpu;
  statistics.failures = json::object();
  for (const json& record : records) {
    localized += record.at("localized").get<bool>() ? 1 : 0;
    ladder_used += record.at("ladder").empty() ? 0 : 1;
    if (record.at("inserted").get<bool>()) {
      ++inserted;
      times.push_back(record.at("sim_time_s").get<double>());
      inserted_paths.push_back(record.at("path_length_m").get<double>());
    } else {
      const std::string reason = record.at("reason").get<std::string>();
      json& count = statistics.failures[reason.substr(0, reason.find(':'))];
      count = count.is_null() ? 1 : count.get<int>() + 1;
      statistics.failed.push_back(record.at("episode").get<std::int64_t>());
    }
    if (!record.at("error").is_null()) errors.push_back(record["error"].at("lateral_m").get<double>());
    moves.push_back(record.at("policy_moves").get<double>());
    contacts.push_back(record.at("contacts").get<double>());
    paths.push_back(record.at("path_length_m").get<double>());
    forces.push_back(record.at("peak_force_n").get<double>());
    impulses.push_back(record.value("impulse_ns", 0.0));
    forbidden.push_back(record.value("forbidden_contacts", 0.0));
    plan.push_back(record.at("timing").value("plan_cpu_s", 0.0));
    statistics.rejected_placements += record.value("rejected_placements", 0);
    cpu.push_back(record.at("timing").at("cpu_s").get<double>());
    statistics.peak_force_max_n = std::max(statistics.peak_force_max_n, record.at("peak_force_n").get<double>());
  }
  const int count = static_cast<int>(records.size());
  statistics.inserted = WilsonRate(inserted, count);
  statistics.localized = WilsonRate(localized, count);
  statistics.ladder_used = WilsonRate(ladder_used, count);
  statistics.sim_time_mean_s = Mean(times);
  statistics.sim_time = BootstrapMedian(times);
  statistics.sim_time_median_s = statistics.sim_time.value;
  statistics.path_length = BootstrapMedian(inserted_paths);
  statistics.peak_force = BootstrapMedian(forces);
  statistics.impulse_median_ns = Median(impulses);
  statistics.forbidden_contacts_mean = Mean(forbidden);
  statistics.plan_cpu_mean_s = Mean(plan);
  statistics.sim_time_max_s = times.empty() ? 0.0 : *std::max_element(times.begin(), times.end());
  statistics.lateral_error_median_m = Median(errors);
  statistics.lateral_error_p95_m = Quantile(errors, 0.95);
  statistics.moves_mean = Mean(moves);
  statistics.contacts_mean = Mean(contacts);
  statistics.path_length_mean_m = Mean(paths);
  statistics.cpu_mean_s = Mean(cpu);
  return statistics;
}

EpisodeSweep::EpisodeSweep(std::string experiment, std::vector<EpisodeSetting> settings,
                           const ExperimentRequest& request)
    : experiment_(std::move(experiment)), settings_(std::move(settings)), request_(request) {}

std::vector<std::int64_t> EpisodeSweep::Numbers(const EpisodeSetting& setting) const {
  return workflow::NumbersOfShard(0, setting.episodes, request_.shard);
}

std::string EpisodeSweep::RecordsFile(const EpisodeSetting& setting) const {
  return request_.out + "/" + experiment_ + "/" + FileName(setting.name);
}

json EpisodeSweep::SettingsJson() const {
  json settings = {{"experiment", experiment_}, {"version", FEELER_VERSION}, {"seed", request_.seed}};
  for (const EpisodeSetting& setting : settings_) settings["rows"].push_back(ToJson(setting));
  return settings;
}

bool EpisodeSweep::Run() {
  std::int64_t total = 0;
  std::vector<std::pair<std::string, std::string>> groups;  // task and cost: one database each
  for (const EpisodeSetting& setting : settings_) {
    total += static_cast<std::int64_t>(Numbers(setting).size());
    workflow::ParseFaults(setting.noise);
    workflow::UsesLadder(setting.policy);  // an unknown policy fails before the first episode
    workflow::ParsePolicyOptions(setting.policy_options);
    const std::pair group{setting.task, setting.cost};
    if (std::find(groups.begin(), groups.end(), group) == groups.end()) groups.push_back(group);
  }
  for (const std::string& folder : {request_.out + "/" + experiment_, request_.out + "/databases"}) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw InputError(folder, "cannot be created: " + error.message(), "choose another folder");
  }
  // Refuses a folder that was begun under other settings.
  CellStore store(PartialFile(request_, experiment_), SettingsJson());
  store.Adopt(PartialFilesOf(request_, experiment_), SettingsJson());
  std::int64_t done = 0;
  for (const auto& [task, cost] : groups) {
    if (!RunGroup(task, cost, done, total)) return false;
  }
  return !request_.shard;
}

struct EpisodeSweep::TaskWorld {
  std::shared_ptr<const workflow::PlanningSetup> setup;
  std::shared_ptr<const env::Scene> scene;
  std::shared_ptr<policies::Database> database;
};

planner::ProblemFamily EpisodeSweep::ProblemsMet(const std::string& name, const std::string& cost,
                                                 const Task& task) const {
  std::set<planner::Extents> met;
  for (const EpisodeSetting& setting : settings_) {
    if (setting.task != name || setting.cost != cost) continue;
    const planner::ProblemFamily family = planner::ParseProblemFamily(setting.extents, task);
    for (const std::int64_t episode : workflow::EpisodeRange(0, setting.episodes)) {
      met.insert(workflow::DrawProblem(family, request_.seed, static_cast<std::uint64_t>(episode)));
    }
  }
  return {{met.begin(), met.end()}, "problems met"};
}

bool EpisodeSweep::RunGroup(const std::string& task, const std::string& cost, std::int64_t& done, std::int64_t total) {
  workflow::PlanningSetupOptions setup_options;
  setup_options.cost_kind = cost == ToString(CostKind::kTime) ? CostKind::kTime : CostKind::kDistance;
  setup_options.jobs = request_.jobs;
  setup_options.progress = request_.map_progress;
  TaskWorld world;
  world.setup = std::make_shared<const workflow::PlanningSetup>(workflow::LoadPlanningSetup(task, setup_options));

  const planner::ProblemFamily needed = ProblemsMet(task, cost, world.setup->task());
  planner::RequireWithinTask(needed, world.setup->task());
  planner::PreprocessOptions build;
  build.solver = planner::FastSetting(planner::SolverKind::kCertified, 1.0);
  build.solver.gap = kGap;
  build.jobs = request_.jobs;
  build.store = request_.store;
  build.cancellation = request_.cancellation;
  build.progress = request_.database_progress;
  const std::string database_file = request_.out + "/databases/" + world.setup->task().name + "-" + cost + ".db";
  if (workflow::BuildDatabase(*world.setup, needed, build, database_file).summary.cancelled) return false;
  world.database = std::make_shared<policies::Database>(policies::Database::OpenReadOnly(database_file));
  world.scene = workflow::BuildEpisodeScene(*world.setup);

  for (const EpisodeSetting& setting : settings_) {
    if (setting.task != task || setting.cost != cost) continue;
    if (!RunSetting(world, setting, done, total)) return false;
    done += static_cast<std::int64_t>(Numbers(setting).size());
  }
  return true;
}

bool EpisodeSweep::RunSetting(const TaskWorld& world, const EpisodeSetting& setting, std::int64_t done,
                              std::int64_t total) {
  const std::string file = RecordsFile(setting);
  const std::vector<std::int64_t> numbers = Numbers(setting);
  std::size_t written = ReadFinished(file, setting, request_.seed, numbers).size();
  std::vector<std::string> files;
  for (const std::string& folder : request_.from)
    files.push_back(folder + "/" + experiment_ + "/" + FileName(setting.name));
  const std::map<std::int64_t, json> of_shards = ReadShards(files, setting, request_.seed);
  std::ofstream out(file, std::ios::app);
  WriteSceneFile(*world.scene, request_.out + "/" + experiment_);
  const auto require_written = [&] {
    if (!out) throw InputError(file, "cannot be written", "check the folder and its free space");
  };
  require_written();

  std::vector<json> with_ladder;
  for (const EpisodeSetting& other : settings_) {
    if (!setting.bare_of.empty() && other.name == setting.bare_of) with_ladder = Records(other);
  }
  /// The record of the i-th number, where it need not be run.
  const auto known = [&](std::size_t i) -> const json* {
    const auto shard = of_shards.find(numbers[i]);
    if (shard != of_shards.end()) return &shard->second;
    return i < with_ladder.size() && with_ladder[i].at("ladder").empty() ? &with_ladder[i] : nullptr;
  };
  // Writes what can be taken over up to the next episode that has to be run.
  const auto take_over = [&] {
    for (; written < numbers.size() && known(written) != nullptr; ++written) out << known(written)->dump() << "\n";
  };
  std::vector<std::int64_t> episodes;
  for (std::size_t i = written; i < numbers.size(); ++i) {
    if (known(i) == nullptr) episodes.push_back(numbers[i]);
  }

  workflow::EpisodeOptions options;
  options.seed = request_.seed;
  options.family = planner::ParseProblemFamily(setting.extents, world.setup->task());
  options.placement = workflow::ParsePlacement(setting.placement);
  options.noise = setting.noise;
  options.ladder = setting.ladder && workflow::UsesLadder(setting.policy);
  options.confirm_limit_m = setting.confirm_limit_m;
  options.replay = true;
  const workflow::PolicyFactory factory =
      workflow::MakePolicyFactory(setting.policy, world.database, workflow::ParsePolicyOptions(setting.policy_options));
  take_over();
  workflow::RunEpisodes(
      episodes, request_.jobs, [&] { return workflow::EpisodeRunner(world.setup, world.scene, factory, options); },
      [&](const workflow::EpisodeRecord& record) {
        out << ToJson(record).dump() << "\n";
        ++written;
        take_over();
        out.flush();
        if (request_.progress) request_.progress(done + static_cast<std::int64_t>(written), total);
      },
      {}, request_.cancellation);
  out.flush();
  require_written();
  return request_.cancellation == nullptr || !request_.cancellation->cancelled();
}

std::vector<json> EpisodeSweep::Records(const EpisodeSetting& setting) const {
  return ReadFinished(RecordsFile(setting), setting, request_.seed, Numbers(setting));
}

}  // namespace feeler::evaluation
