#include "feeler/evaluation/records/episode_json.h"

#include <fmt/format.h>

#include <fstream>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"
#include "feeler/evaluation/records/replay_json.h"

namespace feeler::evaluation {
namespace {

nlohmann::ordered_json PoseJson(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d& p = pose.translation();
  return {{"position_m", {p.x(), p.y(), p.z()}}, {"quaternion_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

nlohmann::ordered_json MoveJson(const execution::MoveRecord& move) {
  nlohmann::ordered_json json = {{"kind", move.kind}, {"direction", move.direction}, {"commanded_m", move.commanded_m}};
  json["predicted"] = move.predicted_m ? nlohmann::ordered_json(*move.predicted_m) : nlohmann::ordered_json();
  json["travelled_m"] = move.travelled_m;
  json["contact"] = move.contact;
  json["peak_force_n"] = move.peak_force_n;
  json["duration_s"] = move.duration_s;
  return json;
}

}  // namespace

nlohmann::ordered_json ToJson(const workflow::EpisodeRecord& record) {
  const execution::ExecutionRecord& execution = record.execution;
  nlohmann::ordered_json json;
  json["task"] = record.task;
  json["policy"] = record.policy;
  json["noise"] = record.noise;
  json["seed"] = record.seed;
  json["episode"] = record.episode;
  json["placement"] = record.placement;
  json["rejected_placements"] = record.rejected_placements;
  json["truth_outside"] = record.truth_outside;
  json["perception"] = nullptr;
  if (record.perception) {
    json["perception"] = {{"distance_m", record.perception->distance_m},
                          {"fitness", record.perception->fitness},
                          {"rms_m", record.perception->rms_m},
                          {"points", record.perception->points}};
  }
  json["extents"] = {record.extents.nx, record.extents.ny, record.extents.nz};
  if (record.extents.n_yaw > 1 || record.extents.n_pitch > 1) {
    json["extents"].push_back(record.extents.n_yaw);
    json["extents"].push_back(record.extents.n_pitch);
  }
  json["true_pose"] = PoseJson(record.world_T_true);
  json["start_estimate"] = PoseJson(record.world_T_estimate0);
  json["estimate"] =
      execution.world_T_estimate ? PoseJson(*execution.world_T_estimate) : nlohmann::ordered_json(nullptr);
  json["error"] = nullptr;
  if (record.error) {
    json["error"] = {{"lateral_m", record.error->lateral_m},
                     {"vertical_m", record.error->vertical_m},
                     {"angle_rad", record.error->angle_rad}};
  }
  json["localized"] = record.localized;
  json["inserted"] = record.inserted;
  json["reason"] = record.reason;
  json["believed"] = {
      {"localized", execution.localized}, {"inserted", execution.inserted}, {"reason", execution.reason}};
  json["moves"] = nlohmann::ordered_json::array();
  for (const execution::MoveRecord& move : execution.moves) json["moves"].push_back(MoveJson(move));
  json["policy_moves"] = execution.policy_moves;
  json["contacts"] = execution.contacts;
  json["path_length_m"] = execution.path_length_m;
  json["sim_time_s"] = execution.sim_time_s;
  json["localization_time_s"] = execution.localization_time_s;
  json["depth_m"] = record.depth_m;
  json["lateral_m"] = record.lateral_m;
  json["peak_force_n"] = record.peak_force_n;
  json["impulse_ns"] = record.impulse_ns;
  json["forbidden_contacts"] = record.forbidden_contacts;
  json["pictures"] = execution.pictures;
  json["fell_in"] = execution.fell_in;
  json["ladder"] = nlohmann::ordered_json::array();
  for (const execution::LadderRecord& rung : execution.ladder) {
    json["ladder"].push_back({{"rung", rung.rung}, {"reason", rung.reason}});
  }
  json["timing"] = {{"perception_cpu_s", record.perception ? record.perception->cpu_s : 0.0},
                    {"plan_cpu_s", record.timing.plan_cpu_s},
                    {"transfer_cpu_s", record.timing.transfer_cpu_s},
                    {"cpu_s", record.timing.cpu_s}};
  if (record.replay) json["replay"] = ReplayJson(record);
  return json;
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
  std::vector<std::string> rungs;
  for (const auto& rung : record.at("ladder")) rungs.push_back(rung.at("rung").get<std::string>());
  return {record.at("task").get<std::string>(),      record.at("policy").get<std::string>(),
          record.at("localized").get<bool>(),        record.at("inserted").get<bool>(),
          record.at("reason").get<std::string>(),    record.at("sim_time_s").get<double>(),
          record.at("path_length_m").get<double>(),  record.at("policy_moves").get<double>(),
          record.at("contacts").get<double>(),       record.at("peak_force_n").get<double>(),
          record.at("timing").at("plan_cpu_s").get<double>(), std::move(rungs)};
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
      if (IsNestedDeeper(line))
        throw InputError(fmt::format("{} line {}", path, number), "is nested too deep", "run the episode again");
      rows.push_back(SummaryRow(nlohmann::json::parse(line)));
    } catch (const nlohmann::json::exception& e) {
      throw InputError(path + " line " + std::to_string(number), std::string("not an episode record: ") + e.what(),
                       "remove the line");
    }
  }
  return rows;
}

}  // namespace feeler::evaluation
