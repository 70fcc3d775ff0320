#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/model/task_file.h"

namespace feeler::env {

/// Tells by MuJoCo's collision detection whether tool and target of a task overlap when the tool frame is displaced
/// from the target frame (axes of the estimated target frame). Touching is not overlapping. One thread at a time; make
/// one per thread.
class OverlapJudge {
 public:
  /// `orientation`: of the target in the estimated target frame. `geoms`: ids in task_model.model.
  OverlapJudge(const TaskModel& task_model, FeltGeoms geoms,
               const Eigen::Quaterniond& orientation = Eigen::Quaterniond::Identity());
  /// The geoms of the tool that can collide, and these of the target.
  OverlapJudge(const TaskModel& task_model, std::vector<int> target_geoms,
               const Eigen::Quaterniond& orientation = Eigen::Quaterniond::Identity())
      : OverlapJudge(task_model, FeltGeoms{task_model.tool_geoms, std::move(target_geoms)}, orientation) {}

  /// Of one pair of geoms (ids in the model).
  bool Overlap(int tool_geom, int target_geom, const Eigen::Vector3d& displacement_m);
  /// Of any pair.
  bool Overlap(const Eigen::Vector3d& displacement_m);

  /// Where two geoms overlap.
  struct Meeting {
    int tool_geom = -1;
    int target_geom = -1;
    Eigen::Vector3d point_m = Eigen::Vector3d::Zero();  ///< in the estimated target frame
    double depth_m = 0.0;
  };
  /// The deepest overlap, if there is one.
  std::optional<Meeting> Meet(const Eigen::Vector3d& displacement_m);

 private:
  /// Near enough to be asked.
  bool Near(int tool_geom, int target_geom, const Eigen::Vector3d& displacement_m) const;
  /// Contacts of one pair; how many.
  int Collide(int tool_geom, int target_geom, const Eigen::Vector3d& displacement_m, mjContact* contacts);

  std::shared_ptr<mjModel> model_;
  DataHandle data_;
  std::vector<int> tool_geoms_;
  std::vector<int> target_geoms_;
  std::vector<Eigen::Vector3d> tool_position_m_;  ///< in the tool frame, by geom id
};

}  // namespace feeler::env
