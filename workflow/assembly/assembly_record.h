#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/execution/contact/execution_record.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/workflow/assembly/assembly.h"
#include "feeler/workflow/episode/pose_error.h"

namespace feeler::workflow {

/// One estimate of the port, and what came of it.
struct InsertionAttempt {
  planner::Extents extents;
  std::string policy_source;  ///< file of the database, or "online: ..." with the reason
  Pose world_T_estimate = Pose::Identity();
  std::optional<PoseError> error;  ///< of the final estimate of the port, if there is one
  bool localized = false;          ///< within the tolerance of the task
  double depth_m = 0.0;            ///< as env::JudgeInsertion
  double lateral_m = 0.0;
  double angle_rad = 0.0;
  std::string reason;  ///< "inserted", or precisely why not
  execution::ExecutionRecord execution;
};

/// One insertion of a build.
struct AssemblyStepRecord {
  std::size_t insertion = 0;
  bool inserted = false;
  std::string reason;
  Pose world_T_true = Pose::Identity();  ///< of the port: where it really was, errors of earlier joints included
  PoseError drawn_error;                 ///< of the port: how far from where it is drawn
  std::vector<InsertionAttempt> attempts;
  Pose world_T_part = Pose::Identity();  ///< where the part stands now; if inserted
  double path_length_m = 0.0;            ///< of the tool, fetching included
  double sim_time_s = 0.0;               ///< likewise
  double peak_force_n = 0.0;
  int forbidden_contacts = 0;  ///< of the arm with anything, of the part with anything but what it goes into
  double cpu_s = 0.0;          ///< measured
};

/// What became of a build.
struct AssemblyRecord {
  std::string assembly;
  std::uint64_t seed = 0;
  std::vector<AssemblyStepRecord> steps;
  std::size_t insertions = 0;  ///< in all
  bool complete = false;       ///< every part stands, and the arm is back home
  bool interrupted = false;
  std::string reason;  ///< "complete", or why it stopped
  double sim_time_s = 0.0;
  double path_length_m = 0.0;
  double cpu_s = 0.0;  ///< measured
};

/// The record as JSON Lines: one object a step, then one with the verdict. Measured times stand under `timing`; all
/// else is a function of assembly, databases and seed.
std::vector<nlohmann::ordered_json> ToJsonLines(const Assembly& assembly, const AssemblyRecord& record);

}  // namespace feeler::workflow
