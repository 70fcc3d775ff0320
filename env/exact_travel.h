#pragma once

#include <memory>
#include <vector>

#include "env/convex_shape.h"
#include "env/task_file.h"
#include "planner/contact/travel_model.h"

namespace feeler::env {

/// Travel from the convex geoms of a task, exact to a micrometre, for a target of any pose. Planes of the target are
/// not taken into account.
class ExactTravel final : public planner::TravelModel {
 public:
  ExactTravel(const TaskModel& task_model, Opening opening);

  std::vector<double> Travel(const Pose& frame_T_target, const std::vector<planner::ToolMotion>& motions) override;

 private:
  std::shared_ptr<const mjModel> model_;
  std::vector<ConvexShape> tool_;  ///< in the tool frame
  struct TargetGeom {
    int geom;
    Pose target_T_geom;
  };
  std::vector<TargetGeom> target_;
};

}  // namespace feeler::env
