#include "feeler/execution/records/episode_line.h"

#include <cstddef>

#include "feeler/execution/records/base64.h"

namespace feeler::execution {
namespace {

using nlohmann::ordered_json;

template <class Value>
ordered_json OrNull(const std::optional<Value>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json MoveJson(const MoveRecord& move) {
  ordered_json json = {{"kind", move.kind}, {"direction", move.direction}, {"commanded_m", move.commanded_m}};
  json["predicted"] = OrNull(move.predicted_m);
  json["travelled_m"] = move.travelled_m;
  json["contact"] = move.contact;
  json["peak_force_n"] = move.peak_force_n;
  json["duration_s"] = move.duration_s;
  return json;
}

/// The robot's side of a replay, and what the executor made of it.
ordered_json WithDecisions(const ordered_json& robot_side, const ExecutionRecord& execution) {
  ordered_json json;
  for (const char* key : {"period_s", "start_s", "samples", "joints", "contacts"}) json[key] = robot_side.at(key);
  json["decisions"] = ordered_json::array();
  for (const DecisionRecord& d : execution.decisions) {
    json["decisions"].push_back(
        {d.attempt, d.motions, d.direction, d.cells, d.travelled_cells, d.contact, d.outcomes, d.left.size()});
  }
  json["hypotheses"] = execution.hypotheses;
  json["ruled_out"] = ToBase64(PackRuns(RuledOutBy(execution, execution.hypotheses)));
  return json;
}

}  // namespace

void PutVarint(std::uint64_t value, std::vector<std::uint8_t>& bytes) {
  for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<std::uint8_t>(value | 0x80));
  bytes.push_back(static_cast<std::uint8_t>(value));
}

std::vector<int> RuledOutBy(const ExecutionRecord& execution, int hypotheses) {
  std::vector<int> ruled_out(static_cast<std::size_t>(hypotheses), 0);
  for (std::size_t i = 0; i < execution.decisions.size(); ++i) {
    const DecisionRecord& decision = execution.decisions[i];
    if (decision.attempt != 0) break;
    std::size_t left = 0;
    for (int h = 0; h < hypotheses; ++h) {
      if (left < decision.left.size() && decision.left[left] == h) {
        ++left;
      } else if (int& by = ruled_out[static_cast<std::size_t>(h)]; by == 0) {
        by = static_cast<int>(i) + 1;
      }
    }
  }
  return ruled_out;
}

std::vector<std::uint8_t> PackRuns(const std::vector<int>& values) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < values.size();) {
    std::size_t end = i;
    while (end < values.size() && values[end] == values[i]) ++end;
    PutVarint(static_cast<std::uint64_t>(values[i]), bytes);
    PutVarint(end - i, bytes);
    i = end;
  }
  return bytes;
}

ordered_json PoseJson(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d& p = pose.translation();
  return {{"position_m", {p.x(), p.y(), p.z()}}, {"quaternion_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

ordered_json ToJson(const EpisodeLine& line, const ExecutionRecord& execution) {
  ordered_json json;
  json["task"] = line.task;
  json["policy"] = line.policy;
  json["noise"] = line.noise;
  if (!line.fault_values.empty()) json["fault_values"] = line.fault_values;
  if (!line.contact_parameters.empty()) json["contact_parameters"] = line.contact_parameters;
  if (!line.started.empty()) json["started"] = line.started;
  if (line.dry) json["dry"] = true;
  json["seed"] = line.seed;
  json["episode"] = line.episode;
  json["placement"] = line.placement;
  json["rejected_placements"] = line.rejected_placements;
  json["truth_outside"] = OrNull(line.truth_outside);
  json["perception"] = nullptr;
  if (line.perception) {
    json["perception"] = {{"distance_m", line.perception->distance_m},
                          {"fitness", line.perception->fitness},
                          {"rms_m", line.perception->rms_m},
                          {"points", line.perception->points}};
  }
  json["extents"] = line.extents;
  json["true_pose"] = line.world_T_true ? PoseJson(*line.world_T_true) : ordered_json(nullptr);
  json["start_estimate"] = PoseJson(line.world_T_estimate0);
  json["estimate"] = execution.world_T_estimate ? PoseJson(*execution.world_T_estimate) : ordered_json(nullptr);
  json["error"] = nullptr;
  if (line.error) {
    json["error"] = {{"lateral_m", line.error->lateral_m},
                     {"vertical_m", line.error->vertical_m},
                     {"angle_rad", line.error->angle_rad}};
  }
  json["localized"] = OrNull(line.localized);
  json["inserted"] = OrNull(line.inserted);
  json["reason"] = line.reason;
  json["believed"] = {{"localized", execution.believed_localized},
                      {"inserted", execution.believed_inserted},
                      {"reason", execution.reason}};
  json["moves"] = ordered_json::array();
  for (const MoveRecord& move : execution.moves) json["moves"].push_back(MoveJson(move));
  json["policy_moves"] = execution.policy_moves;
  json["contacts"] = execution.contacts;
  json["path_length_m"] = execution.path_length_m;
  json["sim_time_s"] = execution.sim_time_s;
  json["localization_time_s"] = execution.localization_time_s;
  json["depth_m"] = OrNull(line.depth_m);
  json["lateral_m"] = OrNull(line.lateral_m);
  json["peak_force_n"] = line.peak_force_n;
  json["force_budget_n"] = execution.force_budget_n;
  json["budget_passings"] = execution.budget_passings;
  json["impulse_ns"] = OrNull(line.impulse_ns);
  json["forbidden_contacts"] = OrNull(line.forbidden_contacts);
  json["pictures"] = execution.pictures;
  json["fell_in"] = execution.fell_in;
  json["ladder"] = ordered_json::array();
  for (const LadderRecord& rung : execution.ladder) {
    json["ladder"].push_back({{"rung", rung.rung}, {"reason", rung.reason}});
  }
  json["timing"] = {{"perception_cpu_s", line.perception_cpu_s},
                    {"plan_cpu_s", line.plan_cpu_s},
                    {"transfer_cpu_s", line.transfer_cpu_s},
                    {"cpu_s", line.cpu_s}};
  if (!line.replay.is_null()) json["replay"] = WithDecisions(line.replay, execution);
  return json;
}

}  // namespace feeler::execution
