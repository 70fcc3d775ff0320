#include "feeler/workflow/setup/visual_goal.h"

#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/vision/wrist_camera.h"

namespace feeler::workflow {

std::shared_ptr<const policies::VisualGoal> TeachVisualGoal(const std::shared_ptr<const env::Scene>& scene,
                                                            double standoff_m) {
  const Task& task = scene->task;
  Pose world_T_goal = task.world_T_target;
  world_T_goal.translation() -= standoff_m * (world_T_goal.linear() * UnitVector(task.insertion));
  const env::DataHandle data = env::MakeData(*scene->model);
  const env::JointVector* best = nullptr;
  const std::vector<env::JointVector> branches = env::ToolInverseKinematics(*scene, world_T_goal);
  for (const env::JointVector& q : branches) {
    env::ResetScene(*scene, q, *data);
    if (data->ncon > 0) continue;
    if (best == nullptr || (q - scene->home_q_rad).norm() < (*best - scene->home_q_rad).norm()) best = &q;
  }
  if (best == nullptr) {
    throw InputError("visual goal", "the place in front of the opening is out of reach or not free",
                     "move the target of task " + task.name);
  }
  env::ResetScene(*scene, *best, *data);
  env::WristCamera camera(scene);
  auto goal = std::make_shared<policies::VisualGoal>();
  goal->view = camera.Look(*data, nullptr);
  env::SurfaceImage surface = camera.Surface(*data);
  goal->hidden = camera.OwnBody(surface);
  goal->depth_m = std::move(surface.depth.depth_m);
  goal->tool_T_target = world_T_goal.inverse() * task.world_T_target;
  return goal;
}

std::shared_ptr<const policies::VisualGoal> VisualGoalOnce::For(const PlanningSetup& setup) {
  const std::lock_guard lock(mutex_);
  if (!goal_) goal_ = TeachVisualGoal(std::make_shared<const env::Scene>(env::BuildScene(setup.model)));
  return goal_;
}

}  // namespace feeler::workflow
