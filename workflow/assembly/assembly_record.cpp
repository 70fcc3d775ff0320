#include "feeler/workflow/assembly/assembly_record.h"

#include <Eigen/Geometry>
#include <cmath>

#include "feeler/perception/input_file.h"

namespace feeler::workflow {
namespace {

using nlohmann::ordered_json;

ordered_json ErrorJson(const PoseError& error) {
  return {{"lateral_m", error.lateral_m}, {"vertical_m", error.vertical_m}, {"angle_rad", error.angle_rad}};
}

ordered_json LadderJson(const execution::ExecutionRecord& execution) {
  ordered_json rungs = ordered_json::array();
  for (const execution::LadderRecord& rung : execution.ladder) {
    rungs.push_back({{"rung", rung.rung}, {"reason", rung.reason}});
  }
  return rungs;
}

ordered_json AttemptJson(const InsertionAttempt& attempt) {
  const execution::ExecutionRecord& execution = attempt.execution;
  const planner::Extents& extents = attempt.extents;
  ordered_json document;
  document["extents"] = {extents.nx, extents.ny, extents.nz, extents.n_yaw, extents.n_pitch};
  document["hypotheses"] = extents.Count();
  document["policy"] = attempt.policy_source;
  document["start_estimate"] = perception::PoseJson(attempt.world_T_estimate);
  document["estimate"] =
      execution.world_T_estimate ? perception::PoseJson(*execution.world_T_estimate) : ordered_json(nullptr);
  document["error"] = attempt.error ? ErrorJson(*attempt.error) : ordered_json(nullptr);
  document["localized"] = attempt.localized;
  document["reason"] = attempt.reason;
  document["depth_m"] = attempt.depth_m;
  document["lateral_m"] = attempt.lateral_m;
  document["angle_rad"] = attempt.angle_rad;
  document["contacts"] = execution.contacts;
  document["policy_moves"] = execution.policy_moves;
  document["motions"] = execution.moves.size();
  document["path_length_m"] = execution.path_length_m;
  document["sim_time_s"] = execution.sim_time_s;
  document["localization_time_s"] = execution.localization_time_s;
  document["ladder"] = LadderJson(execution);
  return document;
}

}  // namespace

std::vector<ordered_json> ToJsonLines(const Assembly& assembly, const AssemblyRecord& record) {
  std::vector<ordered_json> lines;
  for (const AssemblyStepRecord& step : record.steps) {
    const AssemblyInsertion& insertion = assembly.insertions[step.insertion];
    ordered_json json;
    json["assembly"] = record.assembly;
    json["seed"] = record.seed;
    json["step"] = step.insertion;
    json["part"] = assembly.Part(insertion.part).name;
    json["into"] = assembly.Part(insertion.into).name;
    json["port"] = assembly.PortOf(insertion).name;
    json["task"] = insertion.task;
    json["inserted"] = step.inserted;
    json["reason"] = step.reason;
    json["true_pose"] = perception::PoseJson(step.world_T_true);
    json["off_drawing"] = ErrorJson(step.drawn_error);
    json["attempts"] = ordered_json::array();
    for (const InsertionAttempt& attempt : step.attempts) json["attempts"].push_back(AttemptJson(attempt));
    json["part_pose"] = step.inserted ? perception::PoseJson(step.world_T_part) : ordered_json(nullptr);
    json["path_length_m"] = step.path_length_m;
    json["sim_time_s"] = step.sim_time_s;
    json["peak_force_n"] = step.peak_force_n;
    json["forbidden_contacts"] = step.forbidden_contacts;
    json["timing"] = {{"cpu_s", step.cpu_s}};
    lines.push_back(std::move(json));
  }
  std::vector<std::string> standing;
  for (const AssemblyStepRecord& step : record.steps) {
    if (step.inserted) standing.push_back(assembly.Part(assembly.insertions[step.insertion].part).name);
  }
  ordered_json verdict;
  verdict["assembly"] = record.assembly;
  verdict["seed"] = record.seed;
  verdict["complete"] = record.complete;
  verdict["reason"] = record.reason;
  verdict["insertions"] = record.insertions;
  verdict["inserted"] = standing.size();
  verdict["standing"] = standing;
  verdict["path_length_m"] = record.path_length_m;
  verdict["sim_time_s"] = record.sim_time_s;
  verdict["timing"] = {{"cpu_s", record.cpu_s}};
  lines.push_back(std::move(verdict));
  return lines;
}

}  // namespace feeler::workflow
