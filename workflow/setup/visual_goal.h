#pragma once

#include <memory>
#include <mutex>

#include "feeler/env/scene/scene.h"
#include "feeler/policies/visual/visual_servoing_features.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::workflow {

/// Stands the tool in front of the opening of the nominal target, aligned with it and `standoff_m` from its mouth, and
/// takes the picture that visual servoing is to find again, with the depth of each pixel and what the robot hides.
/// Throws InputError when the place is out of reach or the machine cannot render.
std::shared_ptr<const policies::VisualGoal> TeachVisualGoal(const std::shared_ptr<const env::Scene>& scene,
                                                            double standoff_m = 0.01);

/// Teaches the goal of a task when it is first asked for, once; all policies of a run share it. Thread-safe.
class VisualGoalOnce {
 public:
  std::shared_ptr<const policies::VisualGoal> For(const PlanningSetup& setup);

 private:
  std::mutex mutex_;
  std::shared_ptr<const policies::VisualGoal> goal_;
};

}  // namespace feeler::workflow
