#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "feeler/evaluation/harness/experiment.h"
#include "feeler/evaluation/records/statistics.h"
#include "feeler/planner/family/problem_family.h"

namespace feeler::evaluation {

/// Episodes of one setting: a row of an experiment in physics.
struct EpisodeSetting {
  std::string name;  ///< distinct within an experiment; letters, digits, hyphens and blanks
  std::string task = "plug";
  std::string policy = "database";
  std::string cost = "distance";  ///< or "time": what the policies of the database were made to save
  /// The problem that every episode has, e.g. "7x7x7", or a family from which each draws one, "2..15x2..15x2..15".
  std::string extents;
  std::string placement = "nominal";        ///< of the target: "nominal" or "workspace"
  std::vector<std::string> policy_options;  ///< KEY=VALUE (workflow::ParsePolicyOptions)
  std::string noise = "ideal";
  bool ladder = true;
  /// Name of an earlier setting that differs in `ladder = true` alone: an episode in which it used no fallback is the
  /// same without the ladder (tests/evaluation/harness/episode_sweep_test.cpp) and is taken over, the others are run.
  std::string bare_of;
  std::optional<double> confirm_limit_m;  ///< default: the executor's
  std::int64_t episodes = 300;
};
nlohmann::json ToJson(const EpisodeSetting& setting);

/// What the episodes of a setting came to, from their records alone.
struct EpisodeStatistics {
  Rate inserted;
  Rate localized;
  Rate ladder_used;  ///< episodes in which a fallback was tried
  double sim_time_mean_s = 0.0;
  double sim_time_median_s = 0.0;
  Estimate sim_time;                    ///< median, inserted episodes
  double sim_time_max_s = 0.0;          ///< these three over inserted episodes
  double lateral_error_median_m = 0.0;  ///< of the final estimate, across the insertion axis, where there is one
  double lateral_error_p95_m = 0.0;
  double moves_mean = 0.0;
  double contacts_mean = 0.0;
  double path_length_mean_m = 0.0;
  Estimate path_length;  ///< median, inserted episodes, m
  Estimate peak_force;   ///< median, all episodes, N
  double impulse_median_ns = 0.0;
  double forbidden_contacts_mean = 0.0;
  double plan_cpu_mean_s = 0.0;  ///< online planning of an episode; measured
  int rejected_placements = 0;   ///< places that the robot cannot serve, drawn on the way to those of the episodes
  double peak_force_max_n = 0.0;
  double cpu_mean_s = 0.0;           ///< measured: differs from run to run
  nlohmann::json failures;           ///< reason -> episodes not inserted
  std::vector<std::int64_t> failed;  ///< their numbers
};
/// `records`: as in a records file (docs/file-formats.md).
EpisodeStatistics StatisticsOf(const std::vector<nlohmann::json>& records);

/// Runs settings one after the other, each on several threads, and keeps every episode record in
/// OUT/EXPERIMENT/SETTING.jsonl. An interrupted run goes on with the episode that it stopped at. The databases that the
/// policies read are made first, in OUT/databases, for just the problems needed.
class EpisodeSweep {
 public:
  /// `experiment` names the folder of the records. Episode k has the same draws under every setting.
  EpisodeSweep(std::string experiment, std::vector<EpisodeSetting> settings, const ExperimentRequest& request);

  /// False if it was cancelled, or did only a shard. Throws InputError for an unknown task, policy or noise before the
  /// first episode runs.
  bool Run();

  const std::vector<EpisodeSetting>& settings() const { return settings_; }
  /// The records of a setting in order of episode. After Run returned true.
  std::vector<nlohmann::json> Records(const EpisodeSetting& setting) const;
  /// Everything that shaped the result.
  nlohmann::json SettingsJson() const;

 private:
  /// The episodes of a setting: all, or those of the shard.
  std::vector<std::int64_t> Numbers(const EpisodeSetting& setting) const;
  std::string RecordsFile(const EpisodeSetting& setting) const;
  struct TaskWorld;
  /// The problems that the episodes of the settings of a task and a cost draw: what their database has to hold.
  planner::ProblemFamily ProblemsMet(const std::string& name, const std::string& cost, const Task& task) const;
  bool RunGroup(const std::string& task, const std::string& cost, std::int64_t& done, std::int64_t total);
  bool RunSetting(const TaskWorld& world, const EpisodeSetting& setting, std::int64_t done, std::int64_t total);

  std::string experiment_;
  std::vector<EpisodeSetting> settings_;
  ExperimentRequest request_;
};

}  // namespace feeler::evaluation
