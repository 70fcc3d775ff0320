#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/direction.h"
#include "feeler/core/pose.h"

namespace feeler::execution {

/// One motion of the tool, in the vocabulary of the episode records.
struct MoveRecord {
  std::string kind;       ///< transfer, probe, confirm, fall-in, retreat, approach, insert
  std::string direction;  ///< "+x" ... in the axes of the estimated target frame; empty when not along an axis
  double commanded_m = 0.0;
  /// Least and greatest travel predicted under the hypotheses left (never above commanded_m); empty where nothing was
  /// predicted.
  std::optional<std::array<double, 2>> predicted_m;
  double travelled_m = 0.0;
  bool contact = false;
  double peak_force_n = 0.0;  ///< greatest net force of contact; exact in simulation, noise of the sensor left out
  double duration_s = 0.0;    ///< on the clock of the robot, what came before it since the last motion included
};

/// One move of the policy and its answer: a branch of the policy graph that was taken.
struct DecisionRecord {
  int attempt = 0;          ///< 0: the policy's own walk; counts up with every plan of the fallback ladder
  int motions = 0;          ///< motions of `moves` that were made when the answer was known
  std::string direction;    ///< "+x" ...
  int cells = 0;            ///< asked for
  int travelled_cells = 0;  ///< answered
  bool contact = false;     ///< answered
  int outcomes = 0;         ///< different answers that the hypotheses left before it could give
  std::vector<int> left;    ///< the hypotheses that explain it: indices into the problem of the attempt, increasing
};

/// One rung of the fallback ladder that was used.
struct LadderRecord {
  std::string rung;
  std::string reason;
};

/// What happened from the start pose to the verdict, as the executor knows it: nothing here comes from the true pose.
struct ExecutionRecord {
  bool believed_localized = false;       ///< the target pose is known within the tolerance of the task
  bool believed_inserted = false;        ///< at depth, and laterally where the estimate says the opening is
  std::string reason;                    ///< "inserted", or precisely why not
  std::optional<Pose> world_T_estimate;  ///< final estimate of the target pose; empty if it was never localized
  std::array<double, 3> half_width_m{};  ///< of the estimate, per axis, as the evidence leaves it
  int violations = 0;                    ///< touches that the estimate does not explain
  std::vector<MoveRecord> moves;
  std::vector<DecisionRecord> decisions;
  int attempts = 0;      ///< walks of a policy that were begun
  int hypotheses = 0;    ///< of the first of them
  int policy_moves = 0;  ///< guarded moves that the policy asked for (merged ones counted one by one)
  int pictures = 0;      ///< that the policy looked at
  int contacts = 0;      ///< motions that ended at a contact before the insertion
  int grazes = 0;        ///< times an edge was met (or missed) by less than a cell and the lattice shifted
  bool fell_in = false;  ///< the tool slipped into the opening while it probed, and was localized from inside
  double path_length_m = 0.0;
  double sim_time_s = 0.0;
  double localization_time_s = 0.0;  ///< part of sim_time_s until the insertion began its approach
  double peak_force_n = 0.0;
  double force_budget_n = 0.0;  ///< that it was carried out with; 0: none
  int budget_passings = 0;      ///< motions whose peak force lies above it
  /// Greatest force met over the force that the robot's word predicts, per direction, at least 1: from the first
  /// contact above the budget on, probes in that direction are slower by it.
  std::array<double, kDirectionCount> force_excess = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
  /// A transfer met something where the policy knew of nothing, or the plan has failed: transfers go as slowly as
  /// probes until touches explain what was met.
  bool careful = false;
  int startled = 0;  ///< so many ways more, where the surprise was, keep the budget at edges, too
  std::vector<LadderRecord> ladder;
  double policy_cpu_s = 0.0;  ///< measured: belongs under `timing`

  /// The plan has failed: another rung is tried.
  void FallBack(const char* rung, std::string why) {
    ladder.push_back({rung, std::move(why)});
    careful = true;
  }
};

}  // namespace feeler::execution
