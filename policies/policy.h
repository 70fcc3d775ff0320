#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/core/robot.h"
#include "feeler/planner/belief/noise.h"
#include "feeler/planner/belief/problem.h"

namespace feeler::policies {

using planner::Hypothesis;

/// What is known when a decision is due: the cell of the tool in the lattice of the problem, and the hypotheses that
/// are still possible, in the order of the problem. Weights are those of the start belief, not renormalised.
struct Belief {
  Cell robot = Cell::Zero();
  std::vector<Hypothesis> hypotheses;
};

/// The target is localized: insert. With `confirm` the executor first touches along axes that no contact has pinned;
/// without, it inserts at the mean of the hypotheses left (open loop).
struct Insert {
  bool confirm = true;
  /// Where the target is, as seen from the tool that stands still; takes the place of the hypotheses.
  std::optional<Pose> tool_T_target = std::nullopt;
};

/// Follow a velocity for its duration (zero: stay), then look: the picture goes to `Policy::See` before the next
/// decision.
struct Servo {
  TwistMotion motion;
};

/// Inserts without having localized: the tool is pressed lightly on the face around the opening, at the mean of the
/// hypotheses left, and slides outwards along an Archimedean spiral until it drops in.
struct SpiralSearch {
  double radius_m = 0.0045;
  double pitch_m = 0.0015;  ///< from turn to turn
  double speed_m_s = 0.02;
  double press_n = 10.0;
  double face_range_m = 0.003;  ///< the face is looked for this far to both sides of where it is expected
};

/// The policy has no further move. The reason stands in the episode record.
struct GiveUp {
  std::string reason;
};

/// What to do next. Executors visit every alternative.
using Decision = std::variant<GuardedMove, Insert, GiveUp, SpiralSearch, Servo>;

/// What a policy that reckons with wrong readings asks of its executor: to weigh hypotheses by how likely they make a
/// reading, where it would else drop those that the reading contradicts.
struct Doubt {
  planner::Noise noise;     ///< of single steps
  double confidence = 0.0;  ///< of what the policy declares when it inserts
  /// A motion may end short although no contact is reported.
  bool steps_get_lost() const { return noise.missed_contact > 0.0 || noise.slip > 0.0; }
};

/// Decides the next action from what has been felt so far. One object serves many episodes, one after the other:
/// `Begin` erases the past. Not thread-safe: one object per thread. The caller accounts the CPU time of the calls as
/// planning time.
///
/// Protocol: Begin, then Next and Observe (after a Servo: See) in turn until Next returns something else than a guarded
/// move or a Servo; guarded moves come before the first Servo. `Next` is
/// repeatable: without an Observe in between it returns the same decision.
class Policy {
 public:
  virtual ~Policy() = default;

  /// The name in records and on the command line.
  virtual std::string_view name() const = 0;

  /// Starts an episode. Throws InputError when the policy does not fit the problem. The problem outlives the episode.
  virtual void Begin(const planner::Problem& problem) = 0;

  /// What to do in this belief: its hypotheses are consistent with every outcome observed since Begin.
  virtual Decision Next(const Belief& belief) = 0;

  /// Whether Next looks at the hypotheses of the belief. Those who carry out a policy that does not hand it none of
  /// them: no belief is copied for nobody.
  virtual bool reads_hypotheses() const { return true; }

  /// Null (most policies): readings are taken at their word.
  virtual const Doubt* doubt() const { return nullptr; }

  /// Tells the outcome, in lattice terms, that the executor settled on for the move last returned by Next. False when
  /// the policy holds no plan for that outcome; it is then as before the call and may be told another outcome.
  virtual bool Observe(const Outcome& outcome) = 0;

  /// The picture after the last Servo decision.
  virtual void See(const CameraView& /*view*/) {}
};

}  // namespace feeler::policies
