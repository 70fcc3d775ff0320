#include "feeler/cli/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <thread>
#include <vector>

#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/core/error.h"
#include "feeler/env/contact/contact_map_cache.h"

namespace feeler::cli {

bool Session::serves() const { return ranks != nullptr && ranks->rank() > 0; }

CLI::Option* AddShard(CLI::App& command, std::string& text, const std::string& of) {
  return command.add_option(
      "--shard", text,
      "I/N: part I of N, from 1, of " + of +
          "; auto: as the environment of a Slurm array, OpenMPI, PBS or Kubernetes says (docs/scale.md)");
}

CLI::Option* AddWristStiffness(CLI::App& command, double& stiffness_n_m) {
  return AddReal(
      command, "--wrist-stiffness", stiffness_n_m, 0.0, env::Wrist::kStiffest_n_m,
      fmt::format("the gripper holds the tool by springs along its axes, N/m, {:g} or more (docs/execution.md, "
                  "\"Compliance in the wrist\"), default: rigidly",
                  env::Wrist::kSoftest_n_m),
      false);
}

env::SceneOptions SceneOptionsOf(double wrist_stiffness_n_m) {
  if (wrist_stiffness_n_m > 0.0 && wrist_stiffness_n_m < env::Wrist::kSoftest_n_m) {
    throw InputError("--wrist-stiffness",
                     fmt::format("{:g} N/m: a touch takes such springs to their stops", wrist_stiffness_n_m),
                     fmt::format("give {:g} or more, or leave it out", env::Wrist::kSoftest_n_m));
  }
  env::SceneOptions options;
  options.wrist_stiffness_n_m = wrist_stiffness_n_m;
  return options;
}

std::optional<workflow::Shard> ShardOf(const std::string& text) {
  if (text.empty()) return std::nullopt;
  return workflow::ParseShard(text);
}

Parallelism JobsOf(const CLI::App& command, int jobs, const Session& session) {
  return Parallelism(session.ranks != nullptr && command.count("--jobs") == 0 ? 1 : jobs);
}

Parallelism TableJobsOf(Parallelism jobs, const Session& session) {
  if (session.ranks == nullptr) return jobs;
  const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  return Parallelism(std::max(jobs.threads(), std::min(cores, jobs.threads() * workflow::LaunchedOnHost())));
}

void TellCacheFailure(const std::string& reason) {
  static std::once_flag once;
  std::call_once(once,
                 [&] { Note("feeler: the cache does without: {}; FEELER_CACHE_DIR names another folder\n", reason); });
}

std::shared_ptr<const planner::ArrayStore> TablesOfHost(const Session& session) {
  if (session.ranks == nullptr) return nullptr;
  return std::make_shared<const planner::ArrayStore>(env::CacheFolder(), "", TellCacheFailure);
}

nlohmann::json RanksJson(const Session& session, std::int64_t total) {
  nlohmann::json json = nlohmann::json::array();
  if (session.ranks == nullptr) return json;
  std::vector<workflow::RankAccount> accounts = session.ranks->Accounts();
  for (const workflow::RankAccount& account : accounts) total -= account.done;
  accounts.front().done = std::max<std::int64_t>(0, total);
  for (const workflow::RankAccount& account : accounts) {
    json.push_back({{"rank", account.rank}, {"host", account.host}, {"done", account.done}, {"cpu_s", account.cpu_s}});
  }
  return json;
}

void NoteRanks(const Session& session, std::int64_t total) {
  for (const auto& rank : RanksJson(session, total)) {
    Note("rank {} on {}: {} done, {:.1f} s CPU\n", rank["rank"].get<int>(), rank["host"].get<std::string>(),
         rank["done"].get<std::int64_t>(), rank["cpu_s"].get<double>());
  }
}

std::string WithRanks(const std::string& label, const Session& session) {
  if (session.ranks == nullptr) return label;
  return label + " (" + std::to_string(session.ranks->size()) + " ranks)";
}

}  // namespace feeler::cli
