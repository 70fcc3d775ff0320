#pragma once

#include <functional>
#include <limits>
#include <memory>

#include "feeler/execution/contact/contact_evidence.h"
#include "feeler/execution/contact/execution_record.h"
#include "feeler/planner/contact/travel_model.h"

namespace feeler::execution {

class OnlinePlanner;  // recovery/online_planner.h

struct MatchOptions {
  double tolerance_cells = 0.85;  ///< a reading farther than this from every prediction is off the tree
};

/// How a policy is carried out. The defaults suit an ideal arm; `WithFriction` one with joint friction and force noise.
struct ExecutorOptions {
  double transfer_speed_m_s = 0.25;  ///< through space known to be free, watched for contact
  double probe_speed_m_s = 0.05;     ///< where a contact may come; slower where the force budget asks for it
  /// No contact while feeling is to push harder: the speed of each probe follows from it (force_budget.h). Infinite:
  /// the probe speed everywhere.
  double force_budget_n = std::numeric_limits<double>::infinity();
  double contact_force_n = 5.0;    ///< net force that counts as a contact
  double shortfall_m = 0.0002;     ///< a motion that ends this far short of its target has met something soft or weak
  double overtravel_cells = 0.25;  ///< beyond the commanded cell: a wall just behind it is felt, not grazed
  double sure_overtravel_cells = 0.75;  ///< where every hypothesis predicts contact
  /// The probe begins this far before the nearest predicted contact. A truth lies half a cell off its hypothesis at
  /// most (until a contact has tied the lattice to it); the rest is for errors of tracking.
  double fast_margin_cells = 0.65;
  double free_margin_cells = 0.75;  ///< a move is known to be free if no prediction is nearer behind its end
  double retreat_m = 0.0005;        ///< at least so far off a wall after contact, or the next sideways move triggers
  /// Every axis across the insertion is felt until its position is known this well: once, unless the limit is tighter
  /// than what one contact tells (shortfall_m).
  double confirm_limit_m = 0.0005;
  int confirm_attempts = 4;           ///< touches of axes across the insertion that no face has pinned
  int graze_attempts = 3;             ///< shifts of the lattice by edges met within one episode
  double insertion_speed_m_s = 0.02;  ///< where a wall may be met; slower where the force budget asks for it
  /// Between the walls of the opening, where nothing is in front: behind the mouth, until the bottom may come.
  double sliding_speed_m_s = 0.05;
  double insertion_force_limit_n = 60.0;
  double insertion_overdrive_m = 0.001;  ///< commanded beyond the depth, so that a compliant tool reaches it
  int motion_limit = 400;                ///< motions of one episode, whatever the policy
  double time_limit_s = 120.0;           ///< of one episode, on the clock of the robot
  /// What is tried, in this order, when the policy or the insertion fails (fallback_ladder.h).
  bool ladder = false;
  /// Plans around a refit; may be shared by many executors. Null: one is made when first needed.
  std::shared_ptr<OnlinePlanner> online_planner;
  /// The geometry of the task, with the opening as it is: needed where the orientation of the target is uncertain
  /// (pose_attempt.h). Used by one execution at a time.
  std::shared_ptr<planner::TravelModel> travel_model;
  MatchOptions matching;
  FitOptions fit;
  /// Shown the record after every motion (a live view). Must not call the robot.
  std::function<void(const ExecutionRecord&)> on_motion;

  static ExecutorOptions WithFriction() {
    ExecutorOptions options;
    options.contact_force_n = 10.0;
    options.shortfall_m = 0.0004;
    return options;
  }
};

/// The options for a robot that tells contacts from `threshold_n` on: WithFriction where that is more than the default.
ExecutorOptions OptionsForThreshold(double threshold_n);

/// Throws InputError naming the option that is out of range or not a number.
void Validate(const ExecutorOptions& options);

}  // namespace feeler::execution
