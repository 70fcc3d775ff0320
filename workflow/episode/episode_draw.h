#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/task.h"
#include "feeler/env/scene/physics_variation.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/policies/storage/database.h"
#include "feeler/workflow/episode/episode_faults.h"

namespace feeler::workflow {

/// What the camera made of the target, where there is one.
struct PerceptionDraw {
  double distance_m = 0.0;  ///< of the true target from the camera
  double fitness = 0.0;     ///< of the registration (perception/registration.h)
  double rms_m = 0.0;
  int points = 0;
  double cpu_s = 0.0;  ///< measured
};

/// The draws of one episode: which problem is met, and where the target truly is.
struct EpisodeDraw {
  planner::Extents extents;
  Pose world_T_estimate = Pose::Identity();  ///< what the episode is told: the nominal pose of the task
  Pose world_T_true = Pose::Identity();
  int rejected_placements = 0;  ///< places drawn that the robot cannot serve, or the camera cannot see
  std::optional<PerceptionDraw> perception;
  std::string failure;  ///< why there is no episode (no target was found); empty if there is one
};

/// Hypotheses per axis of the task, in the order of its axes.
std::vector<int> AxisExtents(const Task& task, const planner::Extents& cuboid);

/// The problems that episodes draw from: that of `extents` ("7x7x7"), which must lie within the task; where it is empty
/// all that the database has a policy for; without a database the task's. Throws InputError.
planner::ProblemFamily FamilyToDrawFrom(const std::string& extents, policies::Database* database, const Task& task);

/// The problem that episode k of a seed meets: uniform in the family. Throws InputError for an empty family.
planner::Extents DrawProblem(const planner::ProblemFamily& family, std::uint64_t seed, std::uint64_t episode);

/// Episode k of a seed, the same alone or among thousands: its problem, and a true offset uniform
/// in the lattice span plus half a cell each side along every uncertain axis. `noise` then moves the truth outside of
/// that box, or turns it; its other parts are not drawn here. Throws InputError for an empty family.
EpisodeDraw DrawEpisode(const Task& task, const planner::ProblemFamily& family, std::uint64_t seed,
                        std::uint64_t episode, const EpisodeFaults& noise = {});

/// What the ranges of the faults came to in one episode.
struct WorldDraw {
  env::NoiseOptions robot;
  env::PhysicsVariation physics;
  std::map<std::string, double> values;  ///< by name of the fault, in its unit of the command line
};
/// Every fault has a stream of its own. `friction`: of the contacts in the scene.
WorldDraw DrawWorld(const Task& task, const EpisodeFaults& faults, double friction, std::uint64_t seed,
                    std::uint64_t episode);

/// The pose turned by the noise's yaw error about the insertion axis, with the sign of the episode.
Pose TurnedByFault(const Task& task, const EpisodeFaults& noise, std::uint64_t seed, std::uint64_t episode,
                   const Pose& world_T_target);

}  // namespace feeler::workflow
