#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "feeler/core/pose.h"
#include "feeler/execution/contact/execution_record.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/workflow/episode/episode_draw.h"
#include "feeler/workflow/episode/pose_error.h"
#include "feeler/workflow/episode/replay.h"

namespace feeler::workflow {

/// One seeded attempt, scored. Everything but `timing` is a pure function of task, policy, settings, seed and episode.
struct EpisodeRecord {
  std::string task;
  std::string policy;
  std::string noise;
  std::map<std::string, double> fault_values;        ///< what the faults with ranges came to, in their units
  std::map<std::string, double> contact_parameters;  ///< env::ContactParameters of its physics
  std::uint64_t seed = 0;
  std::uint64_t episode = 0;
  std::string placement = "nominal";  ///< how the place of the target was drawn
  int rejected_placements = 0;        ///< places drawn before it that the robot cannot serve, or the camera cannot see
  std::optional<PerceptionDraw> perception;  ///< if the hypotheses come from a camera
  bool truth_outside = false;                ///< the truth is none that the hypotheses stand for
  planner::Extents extents;
  Pose world_T_true = Pose::Identity();       ///< of the target
  Pose world_T_estimate0 = Pose::Identity();  ///< where the episode was told the target would be
  std::optional<PoseError> error;             ///< empty without a final estimate
  bool localized = false;                     ///< the final estimate lies within the task's tolerance on every axis
  bool inserted = false;                      ///< as the environment judges it
  std::string reason;                         ///< "inserted", or why not
  std::string verdict;                        ///< of the judge: "inserted", "too shallow", ...
  double depth_m = 0.0;                       ///< of the tool below the mouth, along the insertion, at the verdict
  double lateral_m = 0.0;                     ///< of the tool beside the axis of the opening, at the verdict
  double peak_force_n = 0.0;                  ///< exact contact force on tool and gripper
  double impulse_ns = 0.0;                    ///< its time integral
  int forbidden_contacts = 0;                 ///< env::RobotStatistics
  execution::ExecutionRecord execution;       ///< what the executor did and believes
  std::optional<Replay> replay;               ///< if it was asked for

  struct Timing {
    double plan_cpu_s = 0.0;      ///< look-up and decisions of the policy
    double transfer_cpu_s = 0.0;  ///< the way to the start pose: planning and physics
    double cpu_s = 0.0;           ///< the whole episode, physics included
  } timing;
};

}  // namespace feeler::workflow
