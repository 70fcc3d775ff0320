#include "feeler/evaluation/records/episode_json.h"

#include <fmt/format.h>

#include <fstream>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"
#include "feeler/evaluation/records/replay_json.h"
#include "feeler/execution/records/episode_line.h"
#include "feeler/planner/family/problem_family.h"

namespace feeler::evaluation {
nlohmann::ordered_json ToJson(const workflow::EpisodeRecord& record) {
  execution::EpisodeLine line;
  line.task = record.task;
  line.policy = record.policy;
  line.noise = record.noise;
  line.fault_values = record.fault_values;
  line.contact_parameters = record.contact_parameters;
  line.seed = record.seed;
  line.episode = record.episode;
  line.placement = record.placement;
  line.rejected_placements = record.rejected_placements;
  line.truth_outside = record.truth_outside;
  if (const auto& seen = record.perception) {
    line.perception = {seen->distance_m, seen->fitness, seen->rms_m, seen->points};
    line.perception_cpu_s = seen->cpu_s;
  }
  line.extents = planner::ToCounts(record.extents);
  line.world_T_true = record.world_T_true;
  line.world_T_estimate0 = record.world_T_estimate0;
  line.error = record.error;
  line.localized = record.localized;
  line.inserted = record.inserted;
  line.reason = record.reason;
  line.depth_m = record.depth_m;
  line.lateral_m = record.lateral_m;
  line.peak_force_n = record.peak_force_n;
  line.impulse_ns = record.impulse_ns;
  line.forbidden_contacts = record.forbidden_contacts;
  line.plan_cpu_s = record.timing.plan_cpu_s;
  line.transfer_cpu_s = record.timing.transfer_cpu_s;
  line.cpu_s = record.timing.cpu_s;
  if (record.replay) line.replay = RobotReplay(*record.replay);
  return execution::ToJson(line, record.execution);
}

EpisodeSummaryRow SummaryRow(const workflow::EpisodeRecord& record) {
  const execution::ExecutionRecord& execution = record.execution;
  std::vector<std::string> rungs;
  for (const execution::LadderRecord& rung : execution.ladder) rungs.push_back(rung.rung);
  return {record.task,
          record.policy,
          record.localized,
          record.inserted,
          record.reason,
          execution.sim_time_s,
          execution.path_length_m,
          static_cast<double>(execution.policy_moves),
          static_cast<double>(execution.contacts),
          record.peak_force_n,
          record.timing.plan_cpu_s,
          std::move(rungs)};
}

EpisodeSummaryRow SummaryRow(const nlohmann::json& record) {
  // On a robot nobody knows what is true: what the executor believes stands for it.
  const auto judged_or_believed = [&](const char* key) {
    return record.at(key).is_null() ? record.at("believed").at(key).get<bool>() : record.at(key).get<bool>();
  };
  std::vector<std::string> rungs;
  for (const auto& rung : record.at("ladder")) rungs.push_back(rung.at("rung").get<std::string>());
  return {record.at("task").get<std::string>(),
          record.at("policy").get<std::string>(),
          judged_or_believed("localized"),
          judged_or_believed("inserted"),
          record.at("reason").get<std::string>(),
          record.at("sim_time_s").get<double>(),
          record.at("path_length_m").get<double>(),
          record.at("policy_moves").get<double>(),
          record.at("contacts").get<double>(),
          record.at("peak_force_n").get<double>(),
          record.at("timing").at("plan_cpu_s").get<double>(),
          std::move(rungs)};
}

std::vector<EpisodeSummaryRow> ReadRecords(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw InputError(path, "cannot be read", "give a records file written by feeler run --out");
  std::vector<EpisodeSummaryRow> rows;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.empty()) continue;
    try {
      const auto record = ParseJsonText<nlohmann::json>(line);
      if (record.is_discarded()) {
        throw InputError(fmt::format("{} line {}", path, number), "is no JSON, or nested too deep",
                         "run the episode again");
      }
      if (record.value("dry", false)) continue;  // nothing moved
      rows.push_back(SummaryRow(record));
    } catch (const nlohmann::json::exception& e) {
      throw InputError(path + " line " + std::to_string(number), std::string("not an episode record: ") + e.what(),
                       "run the episode again");
    }
  }
  return rows;
}

}  // namespace feeler::evaluation
