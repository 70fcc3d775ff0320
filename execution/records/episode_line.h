#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/execution/contact/execution_record.h"
#include "feeler/execution/records/pose_error.h"

namespace feeler::execution {

/// What a camera made of the target.
struct PerceptionLine {
  double distance_m = 0.0;
  double fitness = 0.0;
  double rms_m = 0.0;
  int points = 0;
};

/// One line of a records file as data (docs/file-formats.md, "Episode records"): of a simulated episode, or of one on
/// a robot of which nobody knows what is true. What is not known is null in the line.
struct EpisodeLine {
  std::string task;
  std::string policy;
  std::string noise;
  std::map<std::string, double> fault_values;        ///< what faults with ranges came to, in their units
  std::map<std::string, double> contact_parameters;  ///< how contact feels in this simulation; empty: not known
  std::string
      started;       ///< of a real robot: when, "2026-11-29T17:40:12Z"; empty: a simulation, which seed and number tell
  bool dry = false;  ///< nothing moved: what would be done if the target stood at its estimate
  std::uint64_t seed = 0;
  std::uint64_t episode = 0;
  std::string placement;
  int rejected_placements = 0;
  std::optional<bool> truth_outside;
  std::optional<PerceptionLine> perception;
  std::vector<int> extents;  ///< 3, or 5 with angles
  std::optional<Pose> world_T_true;
  Pose world_T_estimate0 = Pose::Identity();
  std::optional<PoseError> error;
  std::optional<bool> localized;
  std::optional<bool> inserted;
  std::string reason;
  std::optional<double> depth_m;
  std::optional<double> lateral_m;
  double peak_force_n = 0.0;
  std::optional<double> impulse_ns;
  std::optional<int> forbidden_contacts;
  double perception_cpu_s = 0.0;
  double plan_cpu_s = 0.0;
  double transfer_cpu_s = 0.0;
  double cpu_s = 0.0;
  nlohmann::ordered_json replay;  ///< the robot's side of it (RobotReplay); null: none
};

nlohmann::ordered_json ToJson(const EpisodeLine& line, const ExecutionRecord& execution);

/// Position and quaternion, as records have them.
nlohmann::ordered_json PoseJson(const Pose& pose);

/// Per hypothesis of the first attempt: 1 + index of the decision that ruled it out, 0 if none did.
std::vector<int> RuledOutBy(const ExecutionRecord& execution, int hypotheses);
/// Run lengths: value and length, varints.
std::vector<std::uint8_t> PackRuns(const std::vector<int>& values);
/// Seven bits a byte, the last byte below 128.
void PutVarint(std::uint64_t value, std::vector<std::uint8_t>& bytes);

}  // namespace feeler::execution
