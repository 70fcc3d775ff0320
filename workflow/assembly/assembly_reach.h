#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "feeler/env/robot/transfer_checker.h"
#include "feeler/env/scene/scene.h"
#include "feeler/planner/motion/transfer_planner.h"

namespace feeler::workflow {

/// How far the gripper goes straight towards a part that lies, and away from one that it has let go.
inline constexpr double kApproach_m = 0.1;

/// The ways for the arm to stand that serve a motion, out of all branches of its inverse kinematics.
struct ServingBranches {
  std::vector<env::JointVector> q_rad;
  std::string obstacle;  ///< why there is none; empty if there is one
};

/// Which branches serve in one stage of an assembly (workflow/assembly/assembly_stage.h). Not thread-safe.
class StageReach {
 public:
  explicit StageReach(std::shared_ptr<const env::Scene> scene);

  /// At the approach of a grasp: from there straight to the grasp and back, all of it free. The scene is that of
  /// kFetch for the empty gripper; that of kInsert for the part in it, coming out of where it lies.
  ServingBranches AtApproach(const Pose& world_T_grasp);

  /// With the tool at `world_T_start` over a target that is believed at `world_T_target`: from there to the corners of
  /// the workspace of the task (the lower ones: the arm; the part may meet the target there), to the end of the
  /// insertion and, with the part left there, away; all of it free. Scene of kInsert.
  ServingBranches AtStart(const Pose& world_T_target, const Pose& world_T_start);

  env::TransferChecker& transfers() { return roomy_; }

 private:
  std::string Approaches(const env::JointVector& q_rad, const Pose& world_T_grasp);
  std::string Starts(const env::JointVector& q_rad, const Pose& world_T_target);
  /// What the arm without the part touches; empty: nothing.
  std::string ArmCollision(const env::JointVector& q_rad, const Pose& world_T_target);

  std::shared_ptr<const env::Scene> scene_;
  env::TransferChecker roomy_;  ///< with the clearance of transfers
  env::TransferChecker exact_;  ///< without: a part that fits is nearer than any clearance
  env::DataHandle data_;
};

/// A way for the arm to one of these configurations, or to one a whole turn of some joints away. First within half a
/// turn of each joint, then within the joints' limits.
planner::TransferPlan PlanToBranches(env::TransferChecker& checker, const env::Scene& scene,
                                     const env::JointVector& start_rad, const std::vector<env::JointVector>& branches,
                                     std::uint64_t seed);

}  // namespace feeler::workflow
