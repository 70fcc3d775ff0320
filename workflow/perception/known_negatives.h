#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "feeler/core/progress.h"
#include "feeler/env/model/task_file.h"
#include "feeler/workflow/perception/perceive.h"

namespace feeler::workflow {

/// Something that is not the target, shown to the finder where the target would stand.
struct KnownNegative {
  std::string kind;    ///< "plate", "box" or "part"
  std::string what;    ///< "800 x 800 x 10 mm", or the task whose target it is
  bool found = false;  ///< it is taken for the target
  perception::MatchEvidence evidence;
};

/// Shows plates, boxes and the targets of the shipped tasks as a camera at `eye_m` would see them over the bench (faces
/// turned to it, noise of kNoise_m a point): standing as the target would, tilted, and elsewhere. Says which of them
/// are taken for the target (`upright_only`: neither tilted nor elsewhere). Left out are parts that differ from it by
/// less than a camera tells: of 98 % of either surface the other is within kAlike_m. Deterministic. Where
/// `cancellation` asks for it, the list ends early.
std::vector<KnownNegative> TryKnownNegatives(const TargetFinder& finder, const env::TaskModel& task_model,
                                             const Eigen::Vector3d& eye_m,
                                             const CancellationToken* cancellation = nullptr,
                                             bool upright_only = false);

}  // namespace feeler::workflow
