#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "feeler/env/scene/scene.h"
#include "feeler/planner/motion/transfer_planner.h"

namespace feeler::env {

/// Says whether the robot stands free at a joint configuration: robot, gripper and held tool against target, fixtures
/// and each other, by MuJoCo's collision detection on the scene's own geoms (lids excepted). Kinematic: no physics.
///
/// The target may stand at several candidate poses, because a robot that localizes by touch does not know the true one:
/// a configuration is free iff it is free for each of them. Not thread-safe (it holds an mjData): one checker per
/// thread; copies share the model.
class TransferChecker {
 public:
  /// `clearance_m`: everything must stay this far apart. Throws InputError if it is negative or above 15 mm, where
  /// neighbouring wrist links would always count as colliding.
  explicit TransferChecker(const Scene& scene, double clearance_m = 0.004);
  TransferChecker(const TransferChecker& other);
  TransferChecker& operator=(const TransferChecker&) = delete;

  /// Candidate poses of the target; at least one. At first: the nominal pose.
  void SetTargetPoses(std::vector<Pose> world_T_target);

  bool Free(const JointVector& q_rad);
  /// What touches what at `q_rad`, for people ("wrist_1_link and table"); empty when free.
  std::string Collision(const JointVector& q_rad);

  double clearance_m() const { return clearance_m_; }
  /// For planner::TransferOptions: a bound on the way of any point of robot, gripper and tool per radian of each joint.
  const JointVector& reach_m() const { return reach_m_; }

 private:
  Scene scene_;
  std::shared_ptr<const mjModel> model_;  // the scene's, with margins
  DataHandle data_;
  std::vector<Pose> targets_;
  double clearance_m_;
  JointVector reach_m_;
};

/// Of the arm, as its model has them.
planner::JointBounds JointLimits(const Scene& scene);

/// The same place of all links, each joint as near to `start_rad` as whole turns and the bounds, less a margin, allow.
JointVector NearestTwin(const JointVector& q_rad, const JointVector& start_rad, const planner::JointBounds& bounds,
                        double margin_rad = 0.0);

struct TransferSettings {
  double clearance_m = 0.004;
  std::uint64_t seed = 0;
  /// Joints stay within this of zero at first (and of where they are): their own limits are wider, but then every
  /// configuration has twins and the search more room to get lost in. Where no way is found, the limits of the joints
  /// count.
  double joint_bound_rad = 3.14159265358979323846;
  int far_iterations = 20000;  ///< effort of the search within the limits of the joints; 0: none
  /// Configurations looked at, in all; a search that needs more is given up (0: no limit). What an arm over a table
  /// ever needed is far below.
  int most_checks = 200000;
  double twin_margin_rad = 0.0;     ///< goals a turn of some joints away stay this far within the bounds
  planner::TransferOptions search;  ///< seed, reach_m, check_spacing_m and most_checks are set from the above
};

/// Plans a transfer of the arm to one of these configurations, or to the same place of all links nearest to the start,
/// some joints a whole turn away. Way points, where there are any, begin with `start_rad` and are straight in joint
/// space; `goal` of the plan is an index into `goals_rad`.
planner::TransferPlan PlanTransfer(TransferChecker& checker, const Scene& scene, const JointVector& start_rad,
                                   const std::vector<JointVector>& goals_rad, const TransferSettings& settings = {});

/// The same with the tool at `world_T_tool`: all branches of the inverse kinematics are goals.
planner::TransferPlan PlanTransfer(TransferChecker& checker, const Scene& scene, const JointVector& start_rad,
                                   const Pose& world_T_tool, const TransferSettings& settings = {});

/// A geom for people: its name, or that of its body.
std::string NameOfGeom(const mjModel& model, int geom);

}  // namespace feeler::env
