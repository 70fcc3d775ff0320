#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "feeler/env/model/overlap_judge.h"
#include "feeler/env/model/task_file.h"
#include "feeler/planner/contact/convex_obstacle.h"

namespace feeler::env {

/// Low and high end of a stretch of a line in which the tool overlaps the target, metres.
struct BlockedStretch {
  double low_m = 0.0;
  double high_m = 0.0;
};

/// All configuration-space obstacles of a task at one orientation of the target. Immutable; shared by threads.
class ObstacleSet {
 public:
  ObstacleSet(const TaskModel& task_model, FeltGeoms geoms, const Eigen::Quaterniond& orientation);

  struct Obstacle {
    int tool_geom;
    int target_geom;
    planner::ConvexObstacle shape;
  };
  /// A target plane and a tool geom: blocked where normal . displacement < offset_m.
  struct HalfSpace {
    int tool_geom;
    int target_geom;
    Eigen::Vector3d normal;
    double offset_m;
  };
  const TaskModel* task_model;
  FeltGeoms geoms;
  Eigen::Quaterniond orientation;
  std::vector<Obstacle> obstacles;
  std::vector<HalfSpace> half_spaces;
};

/// Sweeps the tool along whole lines. The interval in which a line meets a pair of convex geoms follows from their
/// support points (ConvexObstacle); MuJoCo's collision detection is asked just inside and just outside both its ends
/// (those that another pair does not hide), and where it judges otherwise its boundary, found by bisection, is what
/// counts. One thread at a time; make one per thread.
class LineSweep {
 public:
  /// `accuracy_m`: how close to an end MuJoCo is asked.
  LineSweep(const ObstacleSet& set, double accuracy_m);

  /// The stretches of the line through `point_m` along `axis` in which the tool overlaps the target: disjoint, in
  /// increasing order, with gaps of at least the accuracy. `judged`: ask MuJoCo.
  const std::vector<BlockedStretch>& Sweep(int axis, const Eigen::Vector3d& point_m, bool judged);

  /// How many ends MuJoCo moved, and the farthest it moved one.
  std::int64_t corrections() const { return corrections_; }
  double largest_correction_m() const { return largest_correction_m_; }

 private:
  struct FoundCut {
    const ObstacleSet::Obstacle* obstacle;
    planner::Cut cut;
  };
  bool Hidden(double end_m) const;
  void Cover(const planner::Cut& cut);
  bool IsCovered(const planner::ConvexObstacle& shape, int axis) const;
  void Judge(const ObstacleSet::Obstacle& obstacle, int axis, Eigen::Vector3d point_m, planner::Cut& cut);
  double JudgeEnd(int tool_geom, int target_geom, int axis, Eigen::Vector3d& point_m, double end_m, double inside_m,
                  double probe_m);

  const ObstacleSet& set_;
  double accuracy_m_;
  OverlapJudge judge_;
  std::vector<FoundCut> cuts_;           ///< of the line being swept
  std::vector<FoundCut> judged_;         ///< the same with ends as MuJoCo sees them
  std::vector<BlockedStretch> covered_;  ///< by the cuts so far, disjoint
  std::vector<BlockedStretch> stretches_;
  std::int64_t corrections_ = 0;
  double largest_correction_m_ = 0.0;
};

}  // namespace feeler::env
