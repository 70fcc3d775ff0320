#pragma once

#include <cstdint>
#include <memory>

#include "feeler/core/task.h"
#include "feeler/env/vision/depth_noise.h"
#include "feeler/perception/uncertainty_table.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/workflow/episode/episode_draw.h"
#include "feeler/workflow/perception/perceive.h"

namespace feeler::workflow {

/// What an episode needs to get its hypotheses from a camera. Immutable; share it between runners.
struct EpisodePerception {
  std::shared_ptr<const TargetFinder> finder;
  perception::UncertaintyTable table;
  env::DepthNoiseOptions noise;
};

/// Episode k of a seed as a camera sees it: a target somewhere in the workspace that robot and camera can serve; a
/// picture of it; its registration; the table's cuboid about that (WithKnownPlace), as the smallest problem of the
/// family that covers it. The camera is mounted once for all episodes of a seed. The draw fails, with the reason, where
/// the target is not found or the family has no such problem.
EpisodeDraw DrawPerceived(const Task& task, const EpisodePerception& perception, const planner::ProblemFamily& family,
                          std::uint64_t seed, std::uint64_t episode, CameraCell& cell);

/// The estimate, moved to the target's place along the axes of position that the task knows (a pipe's height): what is
/// certain there is not the camera's to say.
Pose WithKnownPlace(const Task& task, const Pose& world_T_estimate, const Pose& world_T_target);

/// Whether the true position is none that the hypotheses stand for: on some uncertain axis beyond half a cell of the
/// outermost of them (the only failure of the paper's experiment).
bool TruthOutside(const Task& task, const EpisodeDraw& draw);

}  // namespace feeler::workflow
