#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace feeler::planner {

/// Whether the robot stands free at a joint configuration (rad). Called from the thread that plans, many times.
using ValidityFunction = std::function<bool(const Eigen::VectorXd& q_rad)>;

/// The box of joint configurations (rad) that a motion may pass through.
struct JointBounds {
  Eigen::VectorXd lower_rad;
  Eigen::VectorXd upper_rad;
};

struct TransferOptions {
  /// Decides every draw of planner, sampler and simplifier: same seed, same plan, on any thread and after any history.
  std::uint64_t seed = 0;
  /// Metres that a point of the robot moves at most per radian of each joint. The sweep of a motion, sum over joints of
  /// reach * |angle|, bounds the way of every point of the robot; it is also the metric of the search.
  Eigen::VectorXd reach_m;
  /// Largest sweep between two checked configurations. With a validity function that keeps a clearance c, a spacing
  /// <= 2 c makes a plan free of collision everywhere, not only where it was checked.
  double check_spacing_m = 0.005;
  double extension_m = 1.0;         ///< largest sweep of one branch of a search tree
  int iterations_per_goal = 0;      ///< search effort per goal in turn, nearest goals first; it rarely pays
  int iterations_all_goals = 1500;  ///< for all goals together, where no goal was reached in turn
  int plans_to_compare = 2;         ///< stop after this many goals were reached; the shortest plan wins
  int simplification_rounds = 4;    ///< of removing and short-cutting way points
  int most_checks = 0;              ///< calls of the validity function after which the search ends; 0: no limit
  /// Asked before each of them: whether the search is to end. Empty: nobody is asked. Asking changes nothing.
  std::function<bool()> stop;
};

enum class TransferStatus {
  kPlanned,
  kStartInvalid,  ///< the start is out of bounds or not free
  kNoGoal,        ///< no goal was given (out of reach), or none is within bounds and free
  kNotFound,      ///< the search ended without a way
  kStopped,       ///< it was stopped, or had made its most checks
};

struct TransferPlan {
  TransferStatus status = TransferStatus::kNotFound;
  std::string reason;                       ///< for people; empty when planned
  std::vector<Eigen::VectorXd> way_points;  ///< start first; straight in joint space between them; empty if not planned
  int goal = -1;                            ///< index of the goal that it ends in
  double sweep_m = 0.0;                     ///< length in the metric of the search
  int checks = 0;                           ///< calls of the validity function
  bool planned() const { return status == TransferStatus::kPlanned; }
};

/// Motions through free joint space: the straight motion where it is free, else RRT-Connect (Kuffner and LaValle 2000,
/// as implemented in OMPL) to one of several goal configurations, then short-cut. It stops on iterations, never on
/// time (but by `TransferOptions::stop`), and draws from generators of its own only.
///
/// Laws: plan.way_points.front() = start, back() = one of the goals; every configuration at a sweep of at most
/// check_spacing_m along the plan is within bounds and valid; the sweep of the plan is at least that of the straight
/// motion.
class TransferPlanner {
 public:
  /// Throws InputError when sizes do not agree or an option makes no sense.
  TransferPlanner(JointBounds bounds, ValidityFunction valid, TransferOptions options);

  /// `goals` in any order. What cannot be planned is reported in the plan, not thrown.
  TransferPlan Plan(const Eigen::VectorXd& start_rad, const std::vector<Eigen::VectorXd>& goals_rad) const;

  /// Whether the straight motion is free, at the spacing of the options, ends included.
  bool MotionValid(const Eigen::VectorXd& from_rad, const Eigen::VectorXd& to_rad) const;
  /// Sum over joints of reach * |difference|, metres.
  double Sweep(const Eigen::VectorXd& from_rad, const Eigen::VectorXd& to_rad) const;
  bool WithinBounds(const Eigen::VectorXd& q_rad) const;

  const TransferOptions& options() const { return options_; }
  const JointBounds& bounds() const { return bounds_; }

 private:
  JointBounds bounds_;
  ValidityFunction valid_;
  TransferOptions options_;
};

}  // namespace feeler::planner
